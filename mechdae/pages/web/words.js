/** Words of the page in its languages. */

const WORDS = {
  en: {
    play: "Play", pause: "Pause", driver: "Driver", dimensions: "Dimensions", output: "Output", against: "against",
    pose: "Pose", value: "value", bound: "error at most", reset: "Reset", undo: "Undo", redo: "Redo", mode: "Assembly mode",
    certified: "certified", limit: "limit position", unassembled: "does not assemble", recorded: "recorded poses",
    opens: "opens at", ends: "ends at", smaller: "at least", larger: "at most", theme: "Light or dark", velocities: "Velocities",
    selftest: "the numbers differ from Python's: recorded poses are shown", gone: "this mode does not exist there", speed: "Tempo",
    quantity: "quantity", damaged: "the data of this page were altered",
  },
  ru: {
    play: "Пуск", pause: "Пауза", driver: "Привод", dimensions: "Размеры", output: "Величина", against: "по",
    pose: "Положение", value: "значение", bound: "погрешность не более", reset: "Сброс", undo: "Отменить", redo: "Вернуть", mode: "Сборка",
    certified: "доказано", limit: "крайнее положение", unassembled: "не собирается", recorded: "записанные положения",
    opens: "размыкается в", ends: "кончается при", smaller: "не менее", larger: "не более", theme: "Светлая или тёмная", velocities: "Скорости",
    selftest: "числа расходятся с Python: показаны записанные положения", gone: "такой сборки здесь нет", speed: "Темп",
    quantity: "величина", damaged: "данные этой страницы изменены",
  },
};

/** @param {string} lang @returns {(key: string) => string} */
export function wordsOf(lang) {
  const own = WORDS[lang] || WORDS.en;
  return (key) => own[key] || key;
}
