// The page: every view goes to all its parts.

import { announce } from "./announce.js";
import { calibration, setUpCalibration } from "./calibration.js";
import { at, flag, say, show } from "./dom.js";
import { connect as connectStep, health, setUpConnect } from "./health.js";
import { messages, refused } from "./messages.js";
import { muscles } from "./muscles.js";
import { people, setUpPeople } from "./people.js";
import { connect, on } from "./program.js";
import { recognition } from "./recognition.js";
import { record, setUpRecord } from "./record.js";
import { follow, robot, setUpRobot } from "./robot.js";
import { setUpSignals, signals } from "./signals.js";
import { space } from "./space.js";
import { setUpTeach, teach } from "./teach.js";
import { setUpTrain, train } from "./train.js";
import { setUpWork, work } from "./work.js";

const dark = matchMedia("(prefers-color-scheme: dark)");

/** Which theme is drawn: charts have no style sheet. */
function drawnTheme() {
  const { theme } = document.documentElement.dataset;
  return theme ?? (dark.matches ? "dark" : "light");
}

function setUpTheme() {
  const tell = () => { document.documentElement.dataset.drawn = drawnTheme(); };
  at("theme").addEventListener("click", () => {
    const other = drawnTheme() === "dark" ? "light" : "dark";
    document.documentElement.dataset.theme = other;
    localStorage.setItem("theme", other);
    tell();
  });
  dark.addEventListener("change", tell);
  tell();
}

const PARTS = [work, robot, follow, muscles, signals, space, recognition, health, connectStep, teach, calibration, people, record, train, messages];

setUpTheme();
setUpWork();
setUpRobot();
setUpSignals();
setUpConnect();
setUpTeach();
setUpCalibration();
setUpPeople();
setUpRecord();
setUpTrain();
on("view", (view) => PARTS.forEach((part) => part(view)));
on("refused", refused);
on("connection", (problem) => {
  flag(document.body, "stale", problem);
  show(at("lost"), Boolean(problem));
  say(at("lost"), problem);
  if (!problem) announce("Connected to the program.", { topic: "connection" });
});
connect();
