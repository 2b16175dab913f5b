// The strip for the built-in simulator, where the service runs over it: which scenario, how fast, and who is
// driven. Knows the service by /openapi.json alone.

const STATUS_EVERY_MS = 1000;
const DRIVE_EVERY_MS = 150; // a command holds for half a second
const ANSWER_WITHIN_MS = 30000; // loading a scenario draws its floor
const SPEED_MPS = 0.22;
const TURN_RADPS = 1.0;

const part = Object.fromEntries(
  [...document.querySelectorAll("#simulator [id], #simulator")].map((element) => [element.id, element]));

async function call(method, path, body) {
  const answer = await fetch(path, {
    method,
    cache: "no-store",
    headers: { "Content-Type": "application/json" },
    body: method === "GET" ? undefined : JSON.stringify(body ?? {}),
    signal: AbortSignal.timeout(ANSWER_WITHIN_MS),
  });
  if (answer.ok) return answer.json();
  const problem = await answer.json().catch(() => null);
  throw Object.assign(new Error(problem ? problem.detail : `status ${answer.status}`), { status: answer.status });
}

// What a person asked for; where it is refused the strip says why.
async function ask(method, path, body) {
  try {
    const answer = await call(method, path, body);
    part["simulator-fault"].textContent = "";
    return answer;
  } catch (error) {
    part["simulator-fault"].textContent = error.message;
    return null;
  }
}

function sameOptions(select, names) {
  return select.options.length === names.length && names.every((name, i) => select.options[i].value === name);
}

function fill(select, names, chosen) {
  if (!sameOptions(select, names)) select.replaceChildren(...names.map((name) => new Option(name, name)));
  if (chosen !== undefined && document.activeElement !== select) select.value = chosen;
}

function show(status) {
  if (!status) return;
  const duration = status.duration === null ? "" : ` of ${status.duration.toFixed(0)}`;
  part["simulator-state"].textContent = `${status.state}, ${status.time.toFixed(1)}${duration} s, seed ${status.seed}`;
  part["simulator-run"].textContent = status.state === "running" ? "Pause" : "Start";
  part["simulator-run"].disabled = status.state === "ended";
  part["simulator-step"].disabled = status.state !== "paused";
  fill(part["simulator-robot"], status.robots.map(({ id }) => id), part["simulator-robot"].value || undefined);
  if (document.activeElement !== part["simulator-speed"]) part["simulator-speed"].value = String(status.speed);
  part.simulator.dataset.state = status.state;
  if (!scenarios.includes(status.scenario)) scenarios = [status.scenario, ...scenarios];
  fill(part["simulator-scenario"], scenarios, status.scenario);
}

let scenarios = [];
const change = (verb, body) => ask("POST", `/api/v1/simulator/${verb}`, body).then(show);

part["simulator-run"].addEventListener("click", () =>
  change(part.simulator.dataset.state === "running" ? "pause" : "start"));
part["simulator-step"].addEventListener("click", () => change("step", { frames: 1 }));
part["simulator-reset"].addEventListener("click", () => change("reset"));
part["simulator-scenario"].addEventListener("change", () =>
  ask("PUT", "/api/v1/simulator", { scenario: part["simulator-scenario"].value }).then(show));
part["simulator-speed"].addEventListener("change", () =>
  ask("PATCH", "/api/v1/simulator", { speed: Number(part["simulator-speed"].value) }).then(show));

// Driving: the arrow keys while the pad has the focus; who lets go lets the robot's program go on.
const held = new Set();
const KEYS = ["ArrowUp", "ArrowDown", "ArrowLeft", "ArrowRight"];
part["simulator-pad"].addEventListener("keydown", (event) => {
  if (!KEYS.includes(event.key)) return;
  event.preventDefault();
  held.add(event.key);
});
part["simulator-pad"].addEventListener("keyup", (event) => held.delete(event.key));
part["simulator-pad"].addEventListener("blur", () => held.clear());

async function drive() {
  const robot = part["simulator-robot"].value;
  if (held.size === 0 || !robot) return;
  const along = held.has("ArrowUp") - held.has("ArrowDown");
  const turn = held.has("ArrowLeft") - held.has("ArrowRight");
  await ask("POST", `/api/v1/robots/${encodeURIComponent(robot)}/cmd_vel`,
    { v_mps: along * SPEED_MPS, w_radps: turn * TURN_RADPS });
}

async function forEver(everyMs, work) {
  for (;;) {
    if (!document.hidden) await work().catch(() => {}); // the page itself says when the connection is lost
    await new Promise((done) => setTimeout(done, everyMs));
  }
}

try {
  show(await call("GET", "/api/v1/simulator"));
  scenarios = (await call("GET", "/api/v1/scenarios?limit=1000")).items.map(({ name }) => name);
  part.simulator.hidden = false;
  forEver(STATUS_EVERY_MS, async () => show(await call("GET", "/api/v1/simulator")));
  forEver(DRIVE_EVERY_MS, drive);
} catch { // another source: there is nothing to steer
}
