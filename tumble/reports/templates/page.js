/* What all parts of the page use: the data, which are read when a sequence is picked, and elements made from them. */

const byId = (id) => document.getElementById(id);
const dataOf = (id) => JSON.parse(byId(id).textContent);
const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
const SETTINGS = dataOf("settings");
const FONT = "13px system-ui, sans-serif", LARGE_FONT = "18px system-ui, sans-serif";
const state = { number: 0, shown: null, camera: 0, frame: 0, playing: false, images: new Map(), mesh: null };

const sequence = () => state.shown;
const camera = () => sequence().cameras[state.camera] || { frames: [], pictures: [], size: null };
const picture = () => camera().pictures[state.frame];
const reportOf = (frame) => camera().frames.find((entry) => entry.frame === frame);

/* 16-bit integers, little-endian, in base64. */
function unpacked(text) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)), view = new DataView(bytes.buffer);
  return Int16Array.from({ length: bytes.length / 2 }, (_, k) => view.getInt16(2 * k, true));
}

function element(name, attributes, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes || {})) made.setAttribute(key, value);
  made.append(...children);
  return made;
}

function table(heads, rows, label) {
  const head = element("tr", {}, ...heads.map((text) => (text ? element("th", { scope: "col" }, text) : element("td", {}))));
  const body = rows.map((row) => element("tr", {}, ...row.map((cell, k) => {
    const made = element(k ? "td" : "th", k ? {} : { scope: "row" });
    made.append(cell === null || cell === undefined ? "–" : cell);
    return made;
  })));
  const made = element("table", {}, element("thead", {}, head), element("tbody", {}, ...body));
  return element("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": label }, made);
}

/* A table behind a chart: made when it is opened, and anew for another sequence. */
function fillNumbers(details, make) {
  details.open = false;
  details.replaceChildren(details.firstElementChild);
  details.ontoggle = () => { if (details.open && details.childElementCount === 1) details.append(make()); };
}

function sayOn(canvas, text) {
  const context = canvas.getContext("2d");
  context.fillStyle = colour("soft");
  context.font = LARGE_FONT;
  context.textAlign = "center";
  context.fillText(text, canvas.width / 2, canvas.height / 2);
}

function niceStep(range, count) {
  const rough = range / count, power = Math.pow(10, Math.floor(Math.log10(rough)));
  return [1, 2, 5, 10].map((factor) => factor * power).find((step) => step >= rough);
}
