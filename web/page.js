// The page: asks for the poses five times a second and for a picture twice a second, shows both, and says how
// old they are. Knows the service by /openapi.json alone.

const POSES_EVERY_MS = 200;
const PICTURE_EVERY_MS = 500;
const ANSWER_WITHIN_MS = 3000;
const STALE_AFTER_S = 1;
const NEWS_EVERY_MS = 4000;

const page = Object.fromEntries(
  [...document.querySelectorAll("[id]")].map((element) => [element.id, element]));

const seen = {
  answers: [], // of /poses, the newest
  answeredAt: null, // ms, performance.now()
  clockOffset: 0, // s, the server's clock less ours: ages must not depend on two clocks agreeing
  fault: "", // why there is no newer answer, in words
  picture: { captured: null, url: null, fault: "" },
  cameras: [],
};

const sleep = (ms) => new Promise((done) => setTimeout(done, ms));
const serverNow = () => Date.now() / 1000 + seen.clockOffset;
const degrees = (radians) => (radians * 180) / Math.PI;

// A problem's words, or what else went wrong.
async function ask(path) {
  const answer = await fetch(path, { cache: "no-store", signal: AbortSignal.timeout(ANSWER_WITHIN_MS) });
  if (answer.ok) return answer;
  const problem = await answer.json().catch(() => null);
  const refused = new Error(problem ? `${problem.title}: ${problem.detail}` : `status ${answer.status}`);
  refused.answered = true;
  throw refused;
}

const refusal = (error) =>
  error.answered ? `The service answers: ${error.message}.` : "Connection lost, trying again.";

// Never two requests of a kind at once: the next begins when the one before is answered and its time has come.
async function forEver(everyMs, work) {
  for (;;) {
    const begin = performance.now();
    if (!document.hidden) await work();
    await sleep(Math.max(20, everyMs - (performance.now() - begin)));
  }
}

async function askPoses() {
  try {
    const begin = Date.now();
    const poses = await (await ask("/api/v1/poses?limit=1000")).json();
    const middle = (begin + Date.now()) / 2000;
    seen.answers = poses.items;
    seen.total = poses.total;
    if (poses.items.length > 0) seen.clockOffset = poses.items[0].published - middle;
    seen.answeredAt = performance.now();
    seen.fault = "";
  } catch (error) {
    seen.fault = refusal(error);
  }
  show();
}

async function askCameras() {
  const { items } = await (await ask("/api/v1/cameras?limit=1000")).json();
  seen.cameras = items;
  const chosen = page.camera.value;
  page.camera.replaceChildren(...items.map(({ id }) => new Option(id, id, false, id === chosen)));
  page["camera-choice"].hidden = items.length < 2;
}

function pictureWidth(camera) {
  const wanted = page.snapshot.clientWidth * Math.min(2, window.devicePixelRatio || 1);
  return Math.max(64, Math.min(camera.intrinsics.width_px, 1920, Math.ceil(wanted / 160) * 160));
}

async function askPicture() {
  try {
    if (seen.cameras.length === 0) await askCameras();
    const camera = seen.cameras.find(({ id }) => id === page.camera.value) ?? seen.cameras[0];
    if (!camera) throw Object.assign(new Error("there is no camera"), { answered: true });
    const query = `overlay=${page.overlay.checked}&width=${pictureWidth(camera)}`;
    const answer = await ask(`/api/v1/cameras/${encodeURIComponent(camera.id)}/snapshot.jpg?${query}`);
    const url = URL.createObjectURL(await answer.blob());
    const captured = Number(answer.headers.get("Skylight-Captured"));
    showPicture(camera, url);
    seen.picture = { ...seen.picture, captured, fault: "" };
  } catch (error) {
    seen.picture.fault = refusal(error);
    seen.cameras = []; // another service may come back
  }
  showCaption();
}

function showPicture(camera, url) {
  const old = seen.picture.url;
  seen.picture.url = url;
  page.snapshot.onload = () => old && URL.revokeObjectURL(old);
  page.snapshot.src = url;
  page.snapshot.width = camera.intrinsics.width_px;
  page.snapshot.height = camera.intrinsics.height_px;
  const alt = `Camera ${camera.id} from above${page.overlay.checked ? ", robots drawn in" : ""}`;
  if (page.snapshot.alt !== alt) page.snapshot.alt = alt;
  page["camera-name"].textContent = camera.id;
}

function ageText(seconds) {
  if (seconds < 1) return `${Math.max(0, Math.round(seconds * 1000))} ms`;
  if (seconds < 60) return `${seconds.toFixed(1)} s`;
  return seconds < 7200 ? `${Math.round(seconds / 60)} min` : `${Math.round(seconds / 3600)} h`;
}

function showCaption() {
  const { captured, fault } = seen.picture;
  const age = captured === null ? null : serverNow() - captured;
  const stale = age !== null && (age > STALE_AFTER_S || fault !== "");
  page.snapshot.closest("figure").toggleAttribute("data-stale", stale);
  const old = age === null ? "no picture yet" : `${ageText(age)} old`;
  page.caption.textContent = `${stale ? "Stale: " : ""}${old}${fault ? `. ${fault}` : ""}`;
}

function cell(row, name, text) {
  const place = row.querySelector(`[data-cell="${name}"]`);
  if (place.textContent !== text) place.textContent = text;
}

// A column's cell: what it is called where a phone shows no heads, its classes, and the texts in it.
const COLUMNS = [
  { texts: ["robot"] },
  { texts: ["state", "why"], className: "state" },
  { label: "x, m", texts: ["x", "x-spread"], className: "number place" },
  { label: "y, m", texts: ["y", "y-spread"], className: "number place" },
  { label: "Yaw, degrees", texts: ["yaw", "yaw-spread"], className: "number place" },
  { label: "Age, ms", texts: ["age", "stale"], className: "number" },
  { label: "Source", texts: ["source"] },
];

function makeRow(robot) {
  const row = document.createElement("tr");
  row.role = "row";
  row.dataset.robot = robot;
  COLUMNS.forEach(({ label, texts, className = "" }, column) => {
    const place = document.createElement(column === 0 ? "th" : "td");
    place.className = className;
    place.role = column === 0 ? "rowheader" : "cell";
    if (column === 0) place.scope = "row";
    if (label) place.dataset.label = label;
    texts.forEach((name, index) => {
      const part = document.createElement("span");
      part.dataset.cell = name;
      if (index > 0) part.className = "spread";
      place.append(part);
    });
    row.append(place);
  });
  return row;
}

// Without a minus before nothing.
const fixed = (value, digits) => value.toFixed(digits).replace(/^-(?=0\.?0*$)/, "");

// A standard deviation; a very small one is not called 0.
function spreadText(variance, scale, digits, unit) {
  const spread = Math.sqrt(variance) * scale;
  const least = 10 ** -digits;
  return `± ${spread < least ? `<\u2009${least}` : spread.toFixed(spread < 10 ? digits : 0)}${unit}`;
}

function poseCells(row, pose) {
  const spread = (index, ...how) => spreadText(pose.covariance[index], ...how);
  cell(row, "x", pose ? fixed(pose.x, 3) : "–");
  cell(row, "y", pose ? fixed(pose.y, 3) : "–");
  cell(row, "yaw", pose ? fixed(degrees(pose.yaw), 1) : "–");
  cell(row, "x-spread", pose ? spread(0, 1000, 1, " mm") : "");
  cell(row, "y-spread", pose ? spread(4, 1000, 1, " mm") : "");
  cell(row, "yaw-spread", pose ? spread(8, degrees(1), 2, "°") : "");
}

function whyText(answer, sinceAnswer) {
  if (answer.pose) {
    const doubts = answer.pose.warnings.map((warning) => `\u26a0 ${warning}`);
    if (answer.pose.heading_turns > 1) doubts.push("heading known up to a turn");
    return doubts.join("; ");
  }
  const last = answer.last_seen;
  const ago = last === null ? "never seen" : `last seen ${ageText(answer.published - last + sinceAnswer)} ago`;
  return `${answer.reason}; ${ago}`;
}

function showRobot(row, answer, sinceAnswer) {
  const { pose, state } = answer;
  const age = pose ? pose.age + sinceAnswer : null;
  const stale = seen.fault !== "" || (age !== null && age > STALE_AFTER_S);
  cell(row, "robot", answer.robot);
  cell(row, "state", state);
  cell(row, "why", whyText(answer, sinceAnswer));
  row.querySelector(".state").dataset.state = state;
  poseCells(row, pose);
  const ageInMs = age === null ? "–" : `${Math.max(0, Math.round(age * 1000))}`;
  cell(row, "age", age !== null && age >= 10 ? ageText(age) : ageInMs);
  cell(row, "stale", stale ? "stale" : "");
  cell(row, "source", pose ? pose.source : "–");
  row.toggleAttribute("data-stale", stale);
}

function showTable() {
  const sinceAnswer = seen.answeredAt === null ? 0 : (performance.now() - seen.answeredAt) / 1000;
  const rows = new Map([...page.robots.rows].map((row) => [row.dataset.robot, row]));
  seen.answers.forEach((answer, index) => {
    const row = rows.get(answer.robot) ?? makeRow(answer.robot);
    rows.delete(answer.robot);
    if (page.robots.rows[index] !== row) page.robots.insertBefore(row, page.robots.rows[index] ?? null);
    showRobot(row, answer, sinceAnswer);
  });
  rows.forEach((row) => row.remove());
  const shown = seen.answers.length;
  page.count.textContent = shown < (seen.total ?? 0) ? `the first ${shown} of ${seen.total}` : "";
  page["no-robots"].hidden = seen.answeredAt === null || shown > 0;
}

function showLink() {
  const since = seen.answeredAt === null ? null : (performance.now() - seen.answeredAt) / 1000;
  const lost = seen.fault !== "";
  page.link.dataset.link = lost ? "lost" : since === null ? "waiting" : "live";
  page["link-text"].textContent = lost ? "not connected" : since === null ? "connecting" : "live";
  const words = !lost ? "" :
    `${seen.fault} ${since === null ? "" : "The values below are old and marked as stale."}`.trim();
  if (page.banner.textContent !== words) page.banner.textContent = words; // an alert is read out once
  page.banner.hidden = !lost;
}

function showCommand() {
  const robot = seen.answers[0]?.robot ?? "ID";
  const line = `curl ${location.origin}/api/v1/robots/${encodeURIComponent(robot)}/pose`;
  if (page.curl.textContent !== line) page.curl.textContent = line;
}

// Screen readers are told of changes of state, all since the last time in one sentence.
const told = new Map();
function tellNews() {
  const news = [];
  for (const { robot, state } of seen.answers) {
    if (told.has(robot) && told.get(robot) !== state) news.push(`${robot} is now ${state}`);
    told.set(robot, state);
  }
  if (news.length > 0) page.news.textContent = `${news.join(", ")}.`;
}

function show() {
  showLink();
  showTable();
  showCommand();
}

page.copy.addEventListener("click", async () => {
  try {
    await navigator.clipboard.writeText(page.curl.textContent);
    page.copy.textContent = "Copied";
  } catch { // a page without TLS may not: then it is marked, to be copied by hand
    getSelection().selectAllChildren(page.curl);
    page.copy.textContent = "Marked";
  }
  await sleep(1500);
  page.copy.textContent = "Copy";
});

showCommand();
forEver(POSES_EVERY_MS, askPoses);
forEver(PICTURE_EVERY_MS, askPicture);
setInterval(() => { show(); showCaption(); }, 250);
setInterval(tellNews, NEWS_EVERY_MS);
