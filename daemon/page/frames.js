// The frames of the capture under way, or the last one, as the sphere and its table show them: fetched once, then kept up by
// events. It outlives the views, so what was chosen is still chosen when one comes back.
import { get } from "./api.js";
import { letterOfState, Sphere } from "./sphere.js";
import { store } from "./store.js";
import * as stream from "./stream.js";

const AGAIN_MS = 400;
const REASONS_MS = 1500;

export const sphere = new Sphere();
export const reasons = new Map(); // number of a frame → why it is bad
export const frames = {
    state: "asking", // "asking", "there", "none" (no capture yet), "absent" (this lumid cannot tell), "failed"
    error: null,
    lastShot: -1,
};

const listeners = new Set();
let started = false;
let due = 0;
let timer = 0;
let reasonsTimer = 0;
let asking = false;
let reasonsOf = -1;

// `call(what)`: "frames" (all is new), "letters" or "reasons"; at most once a picture of the screen.
export function onFrames(call) {
    listeners.add(call);
    start();
    return () => listeners.delete(call);
}

const waiting = new Set();
function tell(what) {
    waiting.add(what);
    if (!due)
        due = requestAnimationFrame(() => {
            const all = [...waiting];
            due = 0;
            waiting.clear();
            for (const one of all.includes("frames") ? ["frames"] : all)
                listeners.forEach((call) => call(one));
        });
}

async function fetchFrames() {
    clearTimeout(timer);
    timer = 0;
    if (asking)
        return fetchSoon();
    asking = true;
    try {
        const found = await get("/api/v1/capture/frames", { quiet: true });
        const empty = !(found.shots > 0 && found.cameras.length);
        sphere.load(found);
        frames.state = empty ? "none" : "there";
        reasons.clear();
        reasonsOf = -1;
    } catch (error) {
        frames.error = error;
        frames.state = error.word === "absent" ? "absent" : error.word === "busy" || error.word === "notfound" ? "none" : "failed";
    }
    asking = false;
    tell("frames");
    fetchReasons();
    return undefined;
}

function fetchSoon() {
    if (!timer)
        timer = setTimeout(fetchFrames, AGAIN_MS);
}

// The reasons come with events too, but whoever loads the page late has not seen those.
function fetchReasons() {
    const bad = sphere.sum("bad");

    if (reasonsTimer || !bad || bad === reasonsOf)
        return;
    reasonsTimer = setTimeout(async () => {
        reasonsTimer = 0;
        reasonsOf = sphere.sum("bad");
        try {
            const found = await get("/api/v1/missing", { quiet: true });
            for (const one of found.missing) {
                const number = sphere.numbers.get(one.frame) ?? numberOf(one.shot, one.camera);
                if (number >= 0 && one.reason)
                    reasons.set(number, one.reason);
            }
            tell("reasons");
        } catch { /* the letters say it in short */ }
    }, REASONS_MS);
}

function numberOf(shot, camera) {
    const at = sphere.cameras.indexOf(camera);

    return at < 0 ? -1 : shot * sphere.cameras.length + at;
}

function onFrame(data) {
    const number = data.number ?? numberOf(data.shot, data.camera);

    if (frames.state === "absent")
        return;
    if (!sphere.count || number < 0 || number >= sphere.count) {
        fetchSoon();
        return;
    }
    if (data.text)
        reasons.set(number, data.text);
    if (sphere.set(number, data.letter ?? letterOfState(data.state))) {
        tell("letters");
        fetchReasons();
    }
}

// A capture that has just begun, or ended, or another one: all anew.
function onCapture(capture) {
    const path = capture?.path ?? "", shots = capture?.shots ?? 0;
    const key = `${path} ${shots} ${capture?.round} ${["sweeping", "done", "idle"].includes(capture?.state) ? capture.state : ""}`;

    if (key !== onCapture.key) {
        onCapture.key = key;
        fetchSoon();
    }
    tell("letters"); // the arm has moved
}

function start() {
    if (started)
        return;
    started = true;
    stream.on("frame", onFrame);
    stream.on("shot", (data) => {
        frames.lastShot = data.shot;
        tell("letters");
    });
    for (const kind of ["open", "gap"])
        stream.on(kind, fetchSoon);
    store.on("capture", onCapture);
    fetchFrames();
}
