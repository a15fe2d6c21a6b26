/* Two views in three dimensions, orthographic, that the mouse and the arrow keys turn: the body and its trajectory */

const FIRST_TURNS = { body: [0, 0], trajectory: [0.7, -0.45] };
const turns = { body: [...FIRST_TURNS.body], trajectory: [...FIRST_TURNS.trajectory] };
const LIGHT = [-0.4, -0.6, -0.7]; // from the upper left, towards the body from where it is looked at
const ROOM = 0.7; // of half the canvas, that the body fills at most: axes reach beyond it

/* Camera axes, x right, y down, z away, turned about the upright axis and then about the level one. */
function turned(point, [yaw, pitch]) {
  const [x, y, z] = point;
  const a = Math.cos(yaw) * x + Math.sin(yaw) * z, b = -Math.sin(yaw) * x + Math.cos(yaw) * z;
  return [a, Math.cos(pitch) * y - Math.sin(pitch) * b, Math.sin(pitch) * y + Math.cos(pitch) * b];
}

/* Columns of the rotation of a quaternion x, y, z, w: the body's axes. */
function axesOf([x, y, z, w]) {
  return [
    [1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)],
    [2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)],
    [2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)],
  ];
}

const sum = (axes, weights) => [0, 1, 2].map((j) => axes[0][j] * weights[0] + axes[1][j] * weights[1] + axes[2][j] * weights[2]);
const lengthOf = (v) => Math.hypot(...v);
const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

function poseShown() {
  const motion = sequence().trajectory, shown = picture();
  if (!motion) return null;
  const frame = Math.min(shown ? shown.frame : 0, motion.x_mm.length - 1);
  return { frame, axes: axesOf(motion.q[frame]), omega: motion.omega[frame], x: motion.x_mm[frame] };
}

/* The body's surface in body axes, unpacked once for every sequence. */
function meshShown() {
  const body = sequence().body;
  if (!body) return null;
  if (!state.mesh) state.mesh = { vertices: Float64Array.from(unpacked(body.vertices), (value) => value * body.step_mm), faces: unpacked(body.faces) };
  return state.mesh;
}

function drawBody() {
  const mesh = meshShown();
  byId("body-part").hidden = !mesh;
  if (!mesh) return;
  const canvas = byId("body"), context = canvas.getContext("2d"), pose = poseShown();
  const axes = (pose ? pose.axes : [[1, 0, 0], [0, 1, 0], [0, 0, 1]]).map((axis) => turned(axis, turns.body));
  const scale = ROOM * Math.min(canvas.width, canvas.height) / 2 / sequence().body.reach_mm;
  const place = ([x, y]) => [canvas.width / 2 + x * scale, canvas.height / 2 + y * scale];
  const rods = [1, 2, 3].map((name, k) => ({ name, axis: axes[k], style: "ink" }));
  if (pose && lengthOf(pose.omega) > 0) rods.push({ name: "ω", axis: turned(pose.omega.map((value) => value / lengthOf(pose.omega)), turns.body), style: "spin" });
  const points = [];
  for (let k = 0; k < mesh.vertices.length; k += 3) points.push(sum(axes, mesh.vertices.subarray(k, k + 3)));
  context.clearRect(0, 0, canvas.width, canvas.height);
  rods.forEach((rod) => drawRods(context, rod, points, place, true));
  drawSurface(context, mesh.faces, points, place);
  rods.forEach((rod) => drawRods(context, rod, points, place, false));
}

/* The half of an axis that points away (drawn before the body) or towards the eye (from where it leaves the body); its name at the end. */
function drawRods(context, rod, points, place, behind) {
  const long = 1.25 * sequence().body.reach_mm;
  for (const sign of rod.name === "ω" ? [1] : [1, -1]) {
    const along = rod.axis.map((value) => sign * value), end = along.map((value) => value * long);
    if ((end[2] > 0) !== behind) continue;
    const start = along.map((value) => value * (behind ? 0 : Math.min(leaving(along, points), long)));
    context.setLineDash(sign < 0 ? [3, 4] : []);
    drawPath(context, [place(start), place(end)], colour(rod.style), rod.name === "ω" ? 3 : 1.5);
    context.setLineDash([]);
    if (sign > 0) nameRod(context, rod, place(end));
  }
}

function nameRod(context, rod, [x, y]) {
  context.fillStyle = colour(rod.style);
  context.font = LARGE_FONT;
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.fillText(String(rod.name), x + 12 * rod.axis[0], y + 12 * rod.axis[1]);
}

/* How far from the centre a ray leaves the body: the farthest face that it meets [Moller and Trumbore 1997]. */
function leaving(along, points) {
  const faces = meshShown().faces;
  let farthest = 0;
  for (let k = 0; k < faces.length; k += 3) {
    const a = points[faces[k]], u = minus(points[faces[k + 1]], a), v = minus(points[faces[k + 2]], a);
    const across = cross(along, v), determinant = dot(u, across);
    if (Math.abs(determinant) < 1e-12) continue;
    const first = -dot(a, across) / determinant, side = cross(a.map((value) => -value), u), second = dot(along, side) / determinant;
    if (first >= 0 && second >= 0 && first + second <= 1) farthest = Math.max(farthest, dot(v, side) / determinant);
  }
  return farthest;
}

/* Faces that look at the eye, the farthest first, as bright as they look at the light. */
function drawSurface(context, faces, points, place) {
  const facing = [];
  for (let k = 0; k < faces.length; k += 3) {
    const [a, b, c] = [points[faces[k]], points[faces[k + 1]], points[faces[k + 2]]], n = cross(minus(b, a), minus(c, a));
    if (n[2] < 0) facing.push({ a, b, c, n, depth: a[2] + b[2] + c[2] });
  }
  facing.sort((one, other) => other.depth - one.depth);
  context.lineWidth = 1;
  context.lineJoin = "round";
  for (const { a, b, c, n } of facing) {
    const bright = Math.max(0, dot(n, LIGHT) / lengthOf(n) / lengthOf(LIGHT));
    context.fillStyle = context.strokeStyle = "hsl(28 12% " + Math.round(30 + 48 * bright) + "%)";
    context.beginPath();
    for (const point of [a, b, c]) context.lineTo(...place(point));
    context.closePath();
    context.fill();
    context.stroke();
  }
}

function bodyNumbers() {
  return table(["quantity", "value"], sequence().body.facts, "The body in numbers");
}

function bounds() {
  const all = [...(sequence().trajectory ? sequence().trajectory.x_mm : []), ...(sequence().true_trajectory ? sequence().true_trajectory.x_mm : [])];
  const low = [0, 1, 2].map((k) => Math.min(...all.map((p) => p[k]))), high = [0, 1, 2].map((k) => Math.max(...all.map((p) => p[k])));
  const middle = low.map((value, k) => (value + high[k]) / 2);
  return { middle, half: Math.max(1e-6, ...high.map((value, k) => (value - low[k]) / 2)), low, high };
}

function drawTrajectory() {
  const canvas = byId("trajectory"), context = canvas.getContext("2d");
  context.clearRect(0, 0, canvas.width, canvas.height);
  const estimated = sequence().trajectory, truth = sequence().true_trajectory;
  if (!estimated && !truth) { sayOn(canvas, "There is no motion to show."); return; }
  const box = bounds(), size = 0.31 * Math.min(canvas.width, canvas.height) / box.half;
  const place = (point) => {
    const [a, b] = turned(point.map((value, k) => value - box.middle[k]), turns.trajectory);
    return [canvas.width / 2 + a * size, canvas.height / 2 + b * size];
  };
  drawAxes(context, box, place);
  if (truth) drawPath(context, truth.x_mm.map(place), colour("truth"), 7);
  if (estimated) {
    drawPath(context, estimated.x_mm.map(place), colour("estimated"), 2.5);
    drawPose(context, poseShown(), place, box.half * 0.3);
  }
}

function drawPath(context, points, style, width) {
  context.beginPath();
  for (const [x, y] of points) context.lineTo(x, y);
  context.strokeStyle = style;
  context.lineWidth = width;
  context.globalAlpha = width > 4 ? 0.45 : 1;
  context.stroke();
  context.globalAlpha = 1;
}

/* The body's principal axes at the frame shown. */
function drawPose(context, pose, place, length) {
  for (const [k, axis] of pose.axes.entries()) {
    drawPath(context, [place(pose.x), place(pose.x.map((value, j) => value + axis[j] * length))], colour("ink"), 1 + k);
  }
  const [a, b] = place(pose.x);
  context.fillStyle = colour("estimated");
  context.beginPath();
  context.arc(a, b, 5, 0, 7);
  context.fill();
}

function drawAxes(context, box, place) {
  const corner = box.middle.map((value) => value - box.half);
  const step = niceStep(2 * box.half, 4);
  context.font = FONT;
  context.textAlign = "center";
  context.textBaseline = "middle";
  ["x", "y", "z"].forEach((name, k) => {
    const along = (value) => corner.map((start, j) => (j === k ? value : start));
    drawPath(context, [place(corner), place(along(corner[k] + 2 * box.half))], colour("soft"), 1);
    context.fillStyle = colour("soft");
    for (let value = Math.ceil(corner[k] / step) * step; value < corner[k] + 2 * box.half; value += step) {
      const [a, b] = place(along(value));
      context.fillRect(a - 1.5, b - 1.5, 3, 3);
      context.fillText(value.toFixed(step < 1 ? 1 : 0), a + (k === 1 ? -20 : 0), b + (k === 1 ? 0 : 13));
    }
    const [a, b] = place(along(corner[k] + 2.25 * box.half));
    context.fillStyle = colour("ink");
    context.fillText(name, a, b);
  });
}

function trajectoryNumbers() {
  const estimated = sequence().trajectory, truth = sequence().true_trajectory, some = estimated || truth;
  const digits = (row) => row.map((value) => value.toFixed(3));
  const rows = some.x_mm.map((_, k) => [String(k), ...(estimated ? [...digits(estimated.x_mm[k]), ...digits(estimated.q[k])] : []), ...(truth ? digits(truth.x_mm[k] || []) : [])]);
  const heads = ["frame", ...(estimated ? ["x, mm", "y, mm", "z, mm", "q x", "q y", "q z", "q w"] : []), ...(truth ? ["true x, mm", "true y, mm", "true z, mm"] : [])];
  return table(heads, rows, "The trajectory in numbers");
}

function turn(name, yaw, pitch) {
  turns[name][0] += yaw;
  turns[name][1] = Math.max(-1.55, Math.min(1.55, turns[name][1] + pitch));
  (name === "body" ? drawBody : drawTrajectory)();
}

function listenToTurns(name) {
  const canvas = byId(name), keys = { ArrowLeft: [0.1, 0], ArrowRight: [-0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] };
  let last = null;
  canvas.addEventListener("pointerdown", (event) => { last = [event.clientX, event.clientY]; canvas.setPointerCapture(event.pointerId); });
  canvas.addEventListener("pointermove", (event) => {
    if (!last) return;
    turn(name, (last[0] - event.clientX) * 0.01, (event.clientY - last[1]) * 0.01);
    last = [event.clientX, event.clientY];
  });
  canvas.addEventListener("pointerup", () => { last = null; });
  canvas.addEventListener("keydown", (event) => {
    if (event.key === "Home") turns[name] = [...FIRST_TURNS[name]];
    else if (!(event.key in keys)) return;
    turn(name, ...(keys[event.key] || [0, 0]));
    event.preventDefault();
  });
}
