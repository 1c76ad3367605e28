/** Words of the editor in its languages. */

const EDITOR = {
  en: {
    title: "Mechanism editor", preview: "Preview, not certified: save the file and let mechdae solve it.", select: "Select", link: "Link", pivot: "Pivot",
    slider: "Slider", slot: "Slot", bar: "Bar", weld: "Weld", driver: "Driver", delete: "Delete", undo: "Undo", redo: "Redo", grid: "grid of 5 mm", play: "Play", pause: "Pause",
    fit: "Fit", kept: "not drawn, kept as comments in the file", count: "mobility by count", rank: "by rank", pivotless: "superfluous here: an equation of",
    nodriver: "no driver yet", loose: "too few joints for one driver", stiff: "too many joints to move", closes: "closes from", turns: "turns fully",
    singular: "stands at a singular pose", gap: "does not close at", hint_select: "Drag a point; drop it on another to join them", hint_link: "Click points one after the other, Escape ends",
    hint_pivot: "Click a point to fix it to the ground", hint_slider: "Click a point to let it slide, Shift: upright", hint_slot: "Click a point, then the link in which it slides",
    hint_bar: "Click two points: they keep their distance; on nothing it stands on the ground", hint_weld: "Click a point: its links turn together, on a pivot not at all",
    hint_driver: "Click a link or a slider to drive it", hint_delete: "Click what is to go",
    open: "Open", line: "line", too_large: "larger than", unreadable: "cannot be read", toml_key: "a key is needed", toml_value: "not a value that is known here",
    toml_end: "more stands after the value", toml_twice: "given twice", toml_lines: "strings over several lines are not known here", toml_string: "not a string",
    no_number: "not a number", bad_name: "not a name that the editor can draw", not_planar: "the editor draws planar mechanisms", no_links: "no links that the editor draws",
    too_many: "too many links", not_assembled: "does not assemble near its sketch",
  },
  ru: {
    title: "Редактор механизмов", preview: "Предварительный просмотр без доказательства: сохраните файл и решите его в mechdae.", select: "Выбор", link: "Звено", pivot: "Опора",
    slider: "Ползун", slot: "Кулиса", bar: "Стержень", weld: "Жёстко", driver: "Привод", delete: "Удалить", undo: "Отменить", redo: "Вернуть", grid: "сетка 5 мм", play: "Пуск", pause: "Пауза",
    fit: "По размеру", kept: "не изображается, сохранено в файле как примечания", count: "подвижность по счёту", rank: "по рангу", pivotless: "лишнее здесь: уравнение",
    nodriver: "нет привода", loose: "мало связей для одного привода", stiff: "слишком много связей", closes: "собирается от", turns: "поворачивается полностью",
    singular: "особое положение", gap: "не смыкается в", hint_select: "Тяните точку; брошенная на другую соединится с ней", hint_link: "Щёлкайте точки одну за другой, Escape завершает",
    hint_pivot: "Щёлкните точку, чтобы закрепить её", hint_slider: "Щёлкните точку, чтобы она скользила, Shift: вертикально", hint_slot: "Щёлкните точку, затем звено, вдоль которого она скользит",
    hint_bar: "Щёлкните две точки: их расстояние постоянно; на пустом месте — опора", hint_weld: "Щёлкните точку: её звенья жёстко соединятся, на опоре — со стойкой",
    hint_driver: "Щёлкните звено или ползун", hint_delete: "Щёлкните то, что убрать",
    open: "Открыть", line: "строка", too_large: "больше", unreadable: "не читается", toml_key: "нужен ключ", toml_value: "неизвестное здесь значение",
    toml_end: "после значения стоит лишнее", toml_twice: "дано дважды", toml_lines: "строки текста в несколько строк здесь неизвестны", toml_string: "не строка текста",
    no_number: "не число", bad_name: "имя, которое редактор не изобразит", not_planar: "редактор изображает плоские механизмы", no_links: "нет звеньев, которые изображает редактор",
    too_many: "слишком много звеньев", not_assembled: "не собирается вблизи эскиза",
  },
};

/** @param {string} lang @returns {(key: string) => string} */
export function editorWords(lang) {
  const own = EDITOR[lang] || EDITOR.en;
  return (key) => own[key] || key;
}
