/** What can be taken out of a page: SVG, PNG, CSV, the changed problem file. */

/** Offer text or a blob as a download. */
export function offered(name, content, type) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(content instanceof Blob ? content : new Blob([content], { type }));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 2000);
}

/** The SVG with its styles written into it. */
export function svgText(svg) {
  const copy = svg.cloneNode(true);
  const from = svg.querySelectorAll("*");
  copy.querySelectorAll("*").forEach((own, k) => {
    const style = getComputedStyle(from[k]);
    for (const name of ["fill", "stroke", "stroke-width", "stroke-dasharray", "fill-opacity", "font-family", "font-size", "font-style", "paint-order", "visibility"]) {
      own.setAttribute(name, style.getPropertyValue(name));
    }
    own.removeAttribute("class");
  });
  const { width, height } = svg.getBoundingClientRect();
  copy.setAttribute("width", String(width));
  copy.setAttribute("height", String(height));
  copy.setAttribute("xmlns", "http://www.w3.org/2000/svg");
  return new XMLSerializer().serializeToString(copy);
}

/** Draw the SVG to a PNG blob, twice as large. */
export function png(svg, paper) {
  return new Promise((resolve) => {
    const { width, height } = svg.getBoundingClientRect();
    const image = new Image();
    image.onload = () => {
      const canvas = document.createElement("canvas");
      canvas.width = 2 * width;
      canvas.height = 2 * height;
      const context = canvas.getContext("2d");
      context.fillStyle = paper;
      context.fillRect(0, 0, canvas.width, canvas.height);
      context.drawImage(image, 0, 0, canvas.width, canvas.height);
      canvas.toBlob(resolve, "image/png");
    };
    image.src = `data:image/svg+xml;base64,${btoa(unescape(encodeURIComponent(svgText(svg))))}`;
  });
}

/** A table over the poses; heads have units as in mechdae's own CSV. */
export function csvText(session) {
  const { data } = session;
  const { way } = session.motion;
  const law = way.kernel ? ["time [s]"] : [];
  const head = ["status", ...law, ...(data.drivers || [data.driver]).map(({ name, unit }) => `drivers/${name}/position [${unit}]`)];
  const columns = [];
  for (const entry of data.entries) {
    const turn = entry.names[0] === "orientation", axes = turn ? [..."wxyz"] : entry.columns.length > 1 ? [..."xyz"].slice(0, entry.columns.length) : [""];
    entry.names.forEach((name, order) => (turn && order ? [..."xyz"] : axes).forEach((axis, k) => {
      const unit = order ? `${entry.unit}/s${order > 1 ? order : ""}` : turn ? "1" : entry.unit;
      head.push(`${entry.kind}/${entry.part}/${name}${axis ? `/${axis}` : ""} [${unit}]`);
      columns.push((pose) => { const own = session.told(pose, entry, order); return own ? own[k] : null; });
    }));
  }
  const led = (s) => (data.drivers ? [...(way.kernel ? [s] : []), ...way.u(s)] : [s]);
  const lines = session.poses.map((pose, k) => [pose.status, ...led(session.places[k]), ...columns.map((column) => column(pose))]
    .map((value) => (value === null || Number.isNaN(value) ? "" : String(value))).join(","));
  return `${[head.join(","), ...lines].join("\n")}\n`;
}

/** The problem file with the values of the sliders; null where one cannot be written there. */
export function tomlText(file, sliders, theta) {
  let text = file;
  for (let k = 0; k < sliders.length; k += 1) {
    if (theta[k] === sliders[k].value) continue;
    const { name, key } = sliders[k], at = text.indexOf("[parameters]"), line = new RegExp(`^("?)${key}("? *= *)[^\\n#]*`, "m");
    if (!key || at < 0) return null;
    text = text.slice(0, at) + text.slice(at).replace(line, `$1${name}$2${theta[k]}`);
  }
  return text;
}
