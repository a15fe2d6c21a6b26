/* The error of each frame: a chart that is a slider, too */

function errorScale() {
  const frames = camera().frames;
  const values = frames.filter((entry) => entry.used).flatMap((entry) => [entry.rms, entry.residual && entry.residual[0]]).filter((value) => value !== null);
  const top = Math.max(0.2, ...values) * 1.15;
  const last = Math.max(1, ...frames.map((entry) => entry.frame));
  return { left: 44, right: 630, top: 10, bottom: 190, highest: top, last };
}

const errorX = (scale, frame) => scale.left + (scale.right - scale.left) * frame / scale.last;
const errorY = (scale, value) => scale.bottom - (scale.bottom - scale.top) * Math.min(value, scale.highest) / scale.highest;

function drawErrors() {
  const canvas = byId("errors"), context = canvas.getContext("2d"), scale = errorScale();
  context.clearRect(0, 0, canvas.width, canvas.height);
  context.font = FONT;
  drawErrorAxes(context, scale);
  sequence().impacts.forEach((frame) => drawImpact(context, scale, frame));
  camera().frames.forEach((entry) => drawError(context, scale, entry));
  const shown = picture();
  tellErrors(canvas, shown);
  if (!shown) return;
  context.fillStyle = colour("ink");
  context.fillRect(errorX(scale, shown.frame), scale.top, 1, scale.bottom - scale.top);
}

function drawError(context, scale, entry) {
  const x = errorX(scale, entry.frame);
  context.fillStyle = colour(entry.used ? "estimated" : "left-out");
  context.beginPath();
  if (entry.used && entry.rms !== null) context.arc(x, errorY(scale, entry.rms), 3, 0, 7);
  else context.rect(x - 1.5, scale.bottom - 14, 3, 14);
  context.fill();
  if (!entry.used || !entry.residual) return;
  context.strokeStyle = colour("seen");
  context.lineWidth = 1.5;
  context.strokeRect(x - 3, errorY(scale, entry.residual[0]) - 3, 6, 6);
}

function drawImpact(context, scale, frame) {
  context.setLineDash([4, 4]);
  drawPath(context, [[errorX(scale, frame), scale.top], [errorX(scale, frame), scale.bottom]], colour("soft"), 1);
  context.setLineDash([]);
  context.fillStyle = colour("soft");
  context.textAlign = "left";
  context.fillText("impact", errorX(scale, frame) + 4, scale.top + 8);
}

function drawErrorAxes(context, scale) {
  const step = niceStep(scale.highest, 4);
  context.strokeStyle = colour("line");
  context.lineWidth = 1;
  context.fillStyle = colour("soft");
  context.textAlign = "right";
  context.textBaseline = "middle";
  for (let value = 0; value <= scale.highest; value += step) {
    context.strokeRect(scale.left, errorY(scale, value), scale.right - scale.left, 0);
    context.fillText(value.toFixed(step < 0.1 ? 2 : step < 1 ? 1 : 0), scale.left - 8, errorY(scale, value));
  }
  context.textBaseline = "top";
  context.textAlign = "center";
  const across = Math.max(1, niceStep(scale.last, 6));
  for (let frame = 0; frame <= scale.last; frame += across) context.fillText(String(frame), errorX(scale, frame), scale.bottom + 8);
}

/* What a slider says: how many frames there are, and what the one shown is. */
function tellErrors(canvas, shown) {
  canvas.setAttribute("aria-valuemax", Math.max(0, camera().pictures.length - 1));
  canvas.setAttribute("aria-valuenow", state.frame);
  canvas.setAttribute("aria-valuetext", shown ? byId("frame-label").textContent : "no frame to show");
}

function seekByError(event) {
  const canvas = byId("errors"), scale = errorScale();
  const x = event.offsetX * canvas.width / canvas.clientWidth;
  const frame = (x - scale.left) / (scale.right - scale.left) * scale.last;
  const distances = camera().pictures.map((shown) => Math.abs(shown.frame - frame));
  if (distances.length) show(distances.indexOf(Math.min(...distances)));
}

function seekByKey(event) {
  const last = camera().pictures.length - 1;
  const goals = { ArrowLeft: state.frame - 1, ArrowDown: state.frame - 1, ArrowRight: state.frame + 1, ArrowUp: state.frame + 1, PageDown: state.frame - 10, PageUp: state.frame + 10, Home: 0, End: last };
  if (!(event.key in goals)) return;
  show(Math.max(0, Math.min(last, goals[event.key])));
  event.preventDefault();
}

function errorNumbers() {
  const digits = (value) => (value === null ? null : value.toFixed(3));
  const rows = camera().frames.map((entry) => [String(entry.frame), entry.time_ms === null ? null : entry.time_ms.toFixed(3), digits(entry.rms), ...(entry.residual || [null, null, null]).map(digits), entry.used ? (entry.reason ? "in part: " + entry.reason : "yes") : entry.reason]);
  return table(["frame", "time, ms", "RMS ETE, px", "residual RMS, px", "mean, px", "largest, px", "used"], rows, "Errors of each frame");
}
