/* What is said of the sequence shown, in words and tables */

function intervalPicture(row) {
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.setAttribute("viewBox", "0 0 190 22");
  svg.setAttribute("aria-hidden", "true");
  if (!(row.sigma > 0)) return svg;
  const off = row.true === null ? 0 : (row.true - row.value) / row.sigma;
  const scale = 85 / Math.max(3, Math.abs(off) * 1.15), half = 1.959964 * scale;
  const mark = (x, y, width, height, name) => {
    const bar = document.createElementNS("http://www.w3.org/2000/svg", "rect");
    Object.entries({ x, y, width, height, fill: colour(name) }).forEach(([key, value]) => bar.setAttribute(key, value));
    svg.append(bar);
  };
  mark(95 - half, 10, 2 * half, 2, "estimated");
  mark(95 - half, 6, 1, 10, "estimated");
  mark(95 + half - 1, 6, 1, 10, "estimated");
  mark(93, 8, 4, 6, "estimated");
  if (row.true !== null) mark(94 + off * scale, 2, 3, 18, "truth");
  return svg;
}

function fillVelocities() {
  const section = byId("velocities");
  section.replaceChildren();
  const withTruth = sequence().velocities.some((part) => part.rows.some((row) => row.true !== null));
  for (const part of sequence().velocities) {
    const heads = ["", "estimate ± σ", "95 % interval", "", ...(withTruth ? ["truth", "error / σ"] : [])];
    const rows = part.rows.map((row) => {
      const cells = [row.label + ", " + row.unit, row.text, row.interval, element("div", { class: "interval" }, intervalPicture(row))];
      return withTruth ? [...cells, row.true_text, row.pull] : cells;
    });
    section.append(element("h2", {}, part.heading), table(heads, rows, part.heading));
  }
  if (section.childElementCount) section.append(element("p", { class: "caption" }, sequence().world + " Angular velocity is given in the world frame too."));
}

function fillVerdict() {
  const now = sequence(), section = byId("verdict");
  section.className = now.status === "converged" ? "good" : "bad";
  const title = element("h2", {}, now.name + ": ", element("span", { class: "status " + section.className, id: "status" }, now.status));
  const words = [element("p", {}, now.meaning)];
  if (now.message) words.push(element("p", { id: "message" }, now.message));
  const next = element("ul", { id: "next" }, ...now.next.map((text) => element("li", {}, text)));
  section.replaceChildren(title, ...words, element("p", {}, "What to do next:"), next);
}

function ranges(frames) {
  const found = [];
  for (const frame of frames) {
    const last = found[found.length - 1];
    if (last && frame === last[1] + 1) last[1] = frame;
    else found.push([frame, frame]);
  }
  return found.map(([a, b]) => (a === b ? String(a) : a + "–" + b)).join(", ");
}

function fillLeftOut() {
  const section = byId("left-out"), reasons = new Map();
  sequence().cameras.forEach((seen) => seen.frames.filter((entry) => !entry.used).forEach((entry) => {
    const key = seen.name + "\u0000" + entry.reason;
    reasons.set(key, [...(reasons.get(key) || []), entry.frame]);
  }));
  const heading = element("h2", {}, "Frames left out");
  if (!reasons.size) { section.replaceChildren(heading, element("p", { class: "caption" }, "None.")); return; }
  const rows = [...reasons].map(([key, frames]) => [...key.split("\u0000"), String(frames.length), ranges(frames)]);
  section.replaceChildren(heading, table(["camera", "reason", "count", "frames"], rows, "Frames left out"));
}

function fillMinima() {
  const minima = sequence().minima, section = byId("minima");
  section.replaceChildren();
  if (!minima) return;
  const words = "Poses in which the search for the first pose ended, best first. Where the second comes near the first, the pictures leave a choice.";
  const few = minima.rows.slice(0, MOST_MINIMA), more = minima.rows.length - few.length;
  section.append(element("h2", {}, "Competing minima"), table(minima.columns, few, "Competing minima"));
  section.append(element("p", { class: "caption" }, words + (more > 0 ? (more === 1 ? " One that is worse is not shown." : " " + more + " that are worse are not shown.") : "")));
}

const MOST_MINIMA = 6;
const READ = "Files that this was read from";
const NOTES = {
  "Fitted parameters": "At the reference time of the fit. theta is the turn from the estimated pose, so it is zero; com and inertia are departures from the visual hull's.",
  [READ]: "As `sha256sum` prints them: the same digests, the same files.",
};

function fillDetails() {
  const now = sequence(), section = byId("details");
  const parts = [["Fitted parameters", ["parameter", "value", "standard deviation"], now.parameters], ["Statistics", ["name", "value"], now.statistics],
    ["Configuration", ["name", "value"], now.configuration], ["Versions", ["software", "version"], now.versions],
    [READ, ["file", "SHA-256"], now.read]];
  section.replaceChildren(element("h2", {}, "How it was made"), ...parts.filter(([, , rows]) => rows.length).map(([title, heads, rows]) =>
    element("details", {}, element("summary", {}, title), table(heads, rows, title), element("p", { class: "caption" }, NOTES[title] || ""))));
}

