/* The frame, the outlines over it and the residuals between them */

const FACTORS = [0, 1, 2, 5, 10, 20, 50, 100];
const WHISKER_SHARE = 0.02; // of the picture's side, as long as the RMS residual of a typical frame is drawn at most
const OUTLINE_WIDTH = 2.5;

function imageOf(shown) {
  if (!shown.image) return null;
  if (!state.images.has(shown)) {
    const image = new Image();
    image.onload = drawPlayer;
    image.src = shown.image;
    state.images.set(shown, image);
  }
  return state.images.get(shown);
}

/* From steps of the window to the canvas; a pixel's centre lies half a pixel into it. */
function onCanvas(packed, shown, canvas) {
  const half = 0.5 * canvas.width / shown.window[2], scale = canvas.width / SETTINGS.fine;
  return Float64Array.from(unpacked(packed), (value) => value * scale + half);
}

function tracePolygon(context, points) {
  context.beginPath();
  for (let k = 0; k < points.length; k += 2) context.lineTo(points[k], points[k + 1]);
  context.closePath();
}

function drawPolygon(context, points, style, dashed) {
  tracePolygon(context, points);
  context.setLineDash(dashed ? [7, 5] : []);
  context.lineWidth = OUTLINE_WIDTH;
  context.strokeStyle = style;
  context.stroke();
  context.setLineDash([]);
}

function drawPlayer() {
  const canvas = byId("player"), context = canvas.getContext("2d"), shown = picture();
  context.fillStyle = colour("ground");
  context.fillRect(0, 0, canvas.width, canvas.height);
  if (!shown) { sayOn(canvas, "The pictures were not at hand when this report was made."); return; }
  const image = imageOf(shown), seen = shown.seen && onCanvas(shown.seen, shown, canvas);
  context.imageSmoothingEnabled = false;
  if (image && image.complete) context.drawImage(image, 0, 0, canvas.width, canvas.height);
  if (!shown.image && seen) fillSeen(context, seen);
  if (shown.whiskers) drawWhiskers(context, canvas, shown);
  if (seen && byId("show-seen").checked) drawPolygon(context, seen, colour("seen"), true);
  if (shown.estimated && byId("show-estimated").checked) drawPolygon(context, onCanvas(shown.estimated, shown, canvas), colour("estimated"), false);
  drawInset(context, canvas, shown);
}

/* Where there are outlines and no pictures, the silhouette itself stands for the picture. */
function fillSeen(context, seen) {
  tracePolygon(context, seen);
  context.fillStyle = colour("line");
  context.fill();
}

function drawWhiskers(context, canvas, shown) {
  const factor = Number(byId("exaggeration").value);
  byId("factor").textContent = factor > 1 ? "drawn " + factor + " times as long as they are" : factor ? "as long as they are" : "not drawn";
  if (!factor) return;
  const from = onCanvas(shown.whiskers.from, shown, canvas), to = onCanvas(shown.whiskers.to, shown, canvas), px = unpacked(shown.whiskers.px);
  for (const [wide, halo] of [[4, true], [2, false]]) {
    context.lineWidth = wide;
    px.forEach((distance, k) => {
      context.strokeStyle = colour(halo ? "halo" : distance > 0 ? "outside" : "inside");
      context.beginPath();
      context.moveTo(from[2 * k], from[2 * k + 1]);
      context.lineTo(from[2 * k] + factor * (to[2 * k] - from[2 * k]), from[2 * k + 1] + factor * (to[2 * k + 1] - from[2 * k + 1]));
      context.stroke();
    });
  }
}

/* The largest factor with which the RMS residual of the median frame is no longer than its share of the picture. */
function fittingFactor() {
  const shares = camera().pictures.filter((entry) => entry.whiskers).map((entry) => rms(unpacked(entry.whiskers.px)) / SETTINGS.distance_steps / entry.window[2]);
  if (!shares.length) return 0;
  const typical = shares.sort((a, b) => a - b)[Math.floor(shares.length / 2)];
  return FACTORS.filter((factor) => factor * typical <= WHISKER_SHARE).pop() || 1;
}

const rms = (values) => Math.sqrt(values.reduce((total, value) => total + value * value, 0) / values.length);

function fillFactors() {
  const any = camera().pictures.some((entry) => entry.whiskers), best = fittingFactor();
  byId("exaggeration").replaceChildren(...FACTORS.map((factor) => element("option", { value: factor }, factor ? "× " + factor : "off")));
  byId("exaggeration").value = best;
  byId("whisker-key").hidden = byId("whisker-caption").hidden = byId("residual-key").hidden = !any;
  byId("tangency-key").hidden = camera().frames.every((entry) => entry.rms === null);
}

/* Where in the whole picture the shown square lies. */
function drawInset(context, canvas, shown) {
  const size = camera().size;
  if (!size || shown.window[2] >= Math.max(...size)) return;
  const scale = 110 / Math.max(...size), left = canvas.width - size[0] * scale - 10, top = 10;
  context.fillStyle = colour("panel");
  context.globalAlpha = 0.8;
  context.fillRect(left, top, size[0] * scale, size[1] * scale);
  context.globalAlpha = 1;
  context.lineWidth = 1;
  context.strokeStyle = colour("soft");
  context.strokeRect(left, top, size[0] * scale, size[1] * scale);
  context.strokeStyle = colour("estimated");
  context.lineWidth = 2;
  context.strokeRect(left + shown.window[0] * scale, top + shown.window[1] * scale, shown.window[2] * scale, shown.window[2] * scale);
}

function wordsOfFrame(report) {
  const parts = ["Frame " + report.frame];
  if (report.time_ms !== null) parts.push(report.time_ms.toFixed(2) + " ms");
  if (report.used && report.rms !== null) parts.push("RMS ETE " + report.rms.toFixed(2) + " px");
  if (report.residual) parts.push("residual RMS " + report.residual[0].toFixed(2) + ", mean " + report.residual[1].toFixed(2) + ", largest " + report.residual[2].toFixed(2) + " px");
  if (report.reason) parts.push((report.used ? "used in part: " : "left out: ") + report.reason);
  return parts.join(" · ");
}

function labelFrame() {
  const shown = picture(), report = shown && reportOf(shown.frame);
  const words = report ? wordsOfFrame(report) : shown ? "Frame " + shown.frame : "";
  byId("frame-label").textContent = words;
  byId("seek").setAttribute("aria-valuetext", words);
}

function show(frame) {
  const count = camera().pictures.length;
  state.frame = count ? (frame + count) % count : 0;
  byId("seek").value = state.frame;
  labelFrame();
  [drawPlayer, drawErrors, drawBody, drawTrajectory].forEach((draw) => draw());
}

function play(on) {
  state.playing = on;
  byId("play").textContent = on ? "Pause" : "Play";
}
