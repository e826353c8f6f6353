// The connection to the program: views from it, acts to it.

/** A view that is older than this does not look live any more, ms. */
const STALE_MS = 600;
const RETRY_MS = 500;
/** Traces that a hidden window keeps: more than its charts show. */
const MOST_TRACES = 400;

const OLD = "The program shows nothing new: what you see is old.";
const NOTHING = "Connected, but the program has shown nothing yet.";
const LOST = "The connection to the program is lost: what you see is old, and nothing can be sent from here, not even Disarm. "
  + "If the robot moves, stop it by its own switch. Trying again …";
const REFUSED = "The program does not take this window: it was started anew, or eight windows are open. Open the address that it printed.";
const NO_TOKEN = "This address lacks the token of the program's run: open the whole address that the program printed.";

const listeners = { view: [], refused: [], connection: [] };
let socket = null;
let newest = performance.now();
/** The newest view that is not drawn, with the traces of all that were not. */
let waiting = null;
let demonstrations = [];
/** What is wrong with the connection, empty while all is well; null before anything is known. */
let state = null;

/** Calls `then` with every `view`, `refused` text or `connection` text (empty while all is well). */
export function on(what, then) {
  listeners[what].push(then);
}

/** Asks the program for something; says whether it could be sent. */
export function act(name, details = {}) {
  if (socket?.readyState !== WebSocket.OPEN) return false;
  tell("refused", "");
  socket.send(JSON.stringify({ act: name, ...details }));
  return true;
}

/** Gives what somebody typed for a passkey to whoever asks: it is no act, and kept nowhere. */
export function givePasskey(passkey) {
  if (socket?.readyState !== WebSocket.OPEN) return;
  tell("refused", "");
  socket.send(JSON.stringify({ passkey }));
}

/** Connects, and connects again whenever that ends. */
export function connect() {
  const token = readToken();
  if (!token) {
    connection(NO_TOKEN);
    return;
  }
  open(token);
  setInterval(watch, 100);
}

/** The token comes behind the `#` and is kept for reloads of this window. */
function readToken() {
  const given = location.hash.slice(1);
  if (given) {
    sessionStorage.setItem("token", given);
    history.replaceState(null, "", location.pathname);
  }
  return sessionStorage.getItem("token");
}

function open(token) {
  let opened = false;
  socket = new WebSocket(`ws://${location.host}/socket`, ["tonus", token]);
  socket.onopen = () => { opened = true; };
  socket.onmessage = (message) => take(JSON.parse(message.data));
  socket.onclose = async () => {
    socket = null;
    if (opened) connection(LOST);
    else connection(await serverAnswers() ? REFUSED : LOST);
    setTimeout(() => open(token), RETRY_MS);
  };
}

async function serverAnswers() {
  try {
    return (await fetch("/icon.svg", { cache: "no-store" })).ok;
  } catch {
    return false;
  }
}

function take(sent) {
  if (sent.refused !== undefined) {
    tell("refused", sent.refused);
    return;
  }
  if (sent.demonstrations) demonstrations = sent.demonstrations;
  newest = performance.now();
  connection("");
  // Signals of views that are never drawn must not be lost.
  const traces = [...(waiting?.traces ?? []), sent.view.trace].slice(-MOST_TRACES);
  if (!waiting) requestAnimationFrame(draw);
  waiting = { ...sent.view, demonstrations, traces, number: sent.number };
  if (document.hidden) seen();
}

function draw() {
  const view = waiting;
  waiting = null;
  seen(view);
  tell("view", view);
}

/** Lets the next view come: a slow window asks for fewer. A hidden one draws nothing and must not be waited for. */
function seen(view = waiting) {
  if (view && socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify({ seen: view.number }));
}

function watch() {
  if (document.hidden) seen();
  if (performance.now() - newest < STALE_MS) return;
  if (state === "") connection(OLD);
  if (state === null && socket?.readyState === WebSocket.OPEN) connection(NOTHING);
}

function connection(text) {
  if (text === state) return;
  state = text;
  tell("connection", text);
}

function tell(what, value) {
  for (const then of listeners[what]) then(value);
}
