/* Picks a sequence, and listens */

const FRAME_MS = 90;

function pick(number) {
  Object.assign(state, { number, shown: dataOf("sequence-" + number), camera: 0, frame: 0, mesh: null });
  state.images.clear();
  markPicked(number);
  byId("camera").replaceChildren(...sequence().cameras.map((seen, k) => element("option", { value: k }, seen.name)));
  byId("camera-choice").hidden = sequence().cameras.length < 2;
  byId("truth-key").hidden = !sequence().true_trajectory;
  [fillVerdict, fillVelocities, fillLeftOut, fillMinima, fillDetails].forEach((fill) => fill());
  byId("trajectory-numbers").hidden = !(sequence().trajectory || sequence().true_trajectory);
  fillNumbers(byId("body-numbers"), bodyNumbers);
  fillNumbers(byId("trajectory-numbers"), trajectoryNumbers);
  pickCamera(0);
}

function pickCamera(number) {
  state.camera = number;
  byId("seek").max = Math.max(0, camera().pictures.length - 1);
  byId("seen-key").hidden = !camera().pictures.some((shown) => shown.seen);
  fillFactors();
  fillNumbers(byId("errors-numbers"), errorNumbers);
  show(0);
}

/* On paper the page is black on white, whatever the screen is. */
function onPaper(printed) {
  document.documentElement.classList.toggle("paper", printed);
  if (!state.shown) return;
  fillVelocities();
  show(state.frame);
}

function listen() {
  document.querySelector("#index tbody").addEventListener("click", (event) => { if (event.target.matches(".pick")) pick(Number(event.target.dataset.sequence)); });
  document.querySelector("#index tbody").addEventListener("keydown", walk);
  document.querySelectorAll(".sort").forEach((button) => button.addEventListener("click", () => sortBy(Number(button.dataset.column))));
  byId("find").addEventListener("input", filter);
  byId("status-choice").addEventListener("change", filter);
  byId("download").addEventListener("click", download);
  byId("play").addEventListener("click", () => play(!state.playing));
  byId("back").addEventListener("click", () => show(state.frame - 1));
  byId("forth").addEventListener("click", () => show(state.frame + 1));
  byId("seek").addEventListener("input", (event) => show(Number(event.target.value)));
  byId("camera").addEventListener("change", (event) => pickCamera(Number(event.target.value)));
  ["show-estimated", "show-seen", "exaggeration"].forEach((id) => byId(id).addEventListener("change", drawPlayer));
  byId("errors").addEventListener("click", seekByError);
  byId("errors").addEventListener("keydown", seekByKey);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => pick(state.number));
  window.addEventListener("beforeprint", () => onPaper(true));
  window.addEventListener("afterprint", () => onPaper(false));
  ["body", "trajectory"].forEach(listenToTurns);
}

listen();
tellCount();
if (rows().length) pick(0);
setInterval(() => { if (state.playing) show(state.frame + 1); }, FRAME_MS);
