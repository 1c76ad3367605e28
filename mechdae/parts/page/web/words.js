/** Words of the page in its languages. */

const WORDS = {
  en: {
    view: "View", chosen: "oblique", front: "front", top: "top", left: "left", orbit: "drag beside the points, or keys A D W S and 0",
    play: "Play", pause: "Pause", driver: "Driver", dimensions: "Dimensions", output: "Output", against: "against",
    pose: "Pose", value: "value", bound: "error at most", reset: "Reset", undo: "Undo", redo: "Redo", mode: "Assembly mode",
    certified: "certified", limit: "limit position", unassembled: "does not assemble", recorded: "recorded poses",
    opens: "opens at", grows: "grows without bound at", stops: "is proved no further at",
    unreal: "lengths that make no triangle, or numbers without a real value",
    nomode: "no mode", fades: "ends before these dimensions", noname: "unknown name", nonumber: "is no number", smaller: "at least", larger: "at most", theme: "Light or dark", velocities: "Velocities",
    selftest: "the numbers differ from Python's: recorded poses are shown", gone: "this mode does not exist there", speed: "Tempo",
    quantity: "quantity", damaged: "the data of this page were altered",
    forces: "Forces", others: "Other modes", jammed: "jammed: no forces balance", critical: "the solution ends at this share of the friction",
    ambiguous: "several solutions of friction, shown is the one that continues from no friction", still: "at rest in a joint: sign of the coming motion",
    without: "forces are not shown", slow: "quasi-static forces: no speed is given", differ: "they differ from Python's", plan: "Plan", drivers: "Drivers", along: "Curves over", way: "share of the way", velocity: "velocities", acceleration: "accelerations",
    acting: "forces on", rest: "loads, inertia, drive", plans: "Plans", none: "not here", effort: "effort", shape: "Pull dimensions",
  },
  ru: {
    view: "Вид", chosen: "наклонный", front: "спереди", top: "сверху", left: "слева", orbit: "тяните мимо точек или клавиши A D W S и 0",
    play: "Пуск", pause: "Пауза", driver: "Привод", dimensions: "Размеры", output: "Величина", against: "по",
    pose: "Положение", value: "значение", bound: "погрешность не более", reset: "Сброс", undo: "Отменить", redo: "Вернуть", mode: "Сборка",
    certified: "доказано", limit: "крайнее положение", unassembled: "не собирается", recorded: "записанные положения",
    opens: "размыкается в", grows: "уходит в бесконечность в", stops: "дальше не доказывается в",
    unreal: "длины без треугольника или числа без действительного значения",
    nomode: "нет сборки", fades: "кончается до этих размеров", noname: "неизвестное имя", nonumber: "не число", smaller: "не менее", larger: "не более", theme: "Светлая или тёмная", velocities: "Скорости",
    selftest: "числа расходятся с Python: показаны записанные положения", gone: "такой сборки здесь нет", speed: "Темп",
    quantity: "величина", damaged: "данные этой страницы изменены",
    forces: "Силы", others: "Другие сборки", jammed: "заклинено: силы не уравновешиваются", critical: "решение кончается при этой доле трения",
    ambiguous: "решений с трением несколько, показано продолжающее решение без трения", still: "покой в шарнире: знак наступающего движения",
    without: "силы не показаны", slow: "силы квазистатические: скорость не задана", differ: "расходятся с Python", plan: "План", drivers: "Приводы", along: "Кривые по", way: "доля пути", velocity: "скорости", acceleration: "ускорения",
    acting: "силы на звено", rest: "нагрузки, инерция, привод", plans: "Планы", none: "здесь нет", effort: "усилие", shape: "Тянуть размеры",
  },
};

/** @param {string} lang @returns {(key: string) => string} */
export function wordsOf(lang) {
  const own = WORDS[lang] || WORDS.en;
  return (key) => own[key] || key;
}
