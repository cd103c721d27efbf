// Keeps the store as lumid is: asked for once, after every reconnection and every few seconds; in between by events.
import { get } from "./api.js";
import { EVENTS_KEPT, store } from "./store.js";
import * as stream from "./stream.js";

const EVERY_MS = 5000;
const SOON_MS = 150;
const LATER_MS = 1000;

let asked = null;
let again = false;
let soon = null;
let later = null;

async function ask() {
    const status = await get("/api/v1/status");

    store.set("status", status);
    store.set("estop", status.estop);
    store.set("rig", status.rig);
    store.set("cameras", status.cameras);
    store.set("disk", status.store);
    store.set("checks", status.checks);
    store.set("capture", status.capture);
}

// One question at a time; who asks during one is answered by one more.
export function refresh() {
    if (asked) {
        again = true;
        return asked;
    }
    asked = ask().catch(() => {}).then(() => {
        asked = null;
        if (again) {
            again = false;
            return refresh();
        }
        return undefined;
    });
    return asked;
}

function refreshSoon() {
    clearTimeout(soon);
    soon = setTimeout(refresh, SOON_MS);
    later ??= setTimeout(() => { // the board's own word on it comes a little after the event
        later = null;
        refresh();
    }, LATER_MS);
}

function keep(event) {
    if (event.kind === "progress" || event.kind === "picture" || event.kind === "people")
        return;
    const events = store.get("events");

    if (event.id && events.some((one) => one.id === event.id))
        return; // sent again after a reconnection
    store.set("events", [...events.slice(1 - EVENTS_KEPT), event]);
}

function check(data) {
    const checks = [...store.get("checks")];
    const at = checks.findIndex((one) => one.name === data.name);
    const one = { name: data.name, verdict: data.verdict, overridden: data.overridden, reason: data.reason };

    if (at < 0)
        checks.push(one);
    else
        checks[at] = one;
    store.set("checks", checks);
}

export function followState() {
    stream.on("*", keep);
    stream.on("progress", (data) => store.set("capture", { ...store.get("capture"), ...data }));
    stream.on("state", (data) => {
        if (data.state === "preflight" && store.get("capture")?.state !== "preflight")
            store.set("checks", []);
        store.set("capture", { ...store.get("capture"), state: data.state, text: data.text });
        refreshSoon();
    });
    stream.on("check", check);
    stream.on("people", (data) => store.set("people", data.people ?? []));
    for (const kind of ["incident", "gap", "sealed"])
        stream.on(kind, refreshSoon);
    setInterval(() => {
        if (!document.hidden && store.get("connection").state === "open")
            refresh();
    }, EVERY_MS);
}
