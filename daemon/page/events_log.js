// What happened, for people: of all events those that somebody would want to read, the newest first, also after the page was
// loaded anew. Thousands of frames that went well are told by the sphere, not here.
import { has, t } from "./i18n.js";
import { KINDS } from "./sphere.js";
import * as stream from "./stream.js";
import { checkTitle, saidWords, stateWord } from "./words.js";

export const KEPT = 200;
const KEY = "lumid.events";
const SAVE_MS = 1000;

// {time, kind, level: "bad" | "warn" | "good" | "info", data}, the newest first.
export let entries = load();
const listeners = new Set();
let saving = 0;

function load() {
    try {
        const found = JSON.parse(sessionStorage.getItem(KEY));
        return Array.isArray(found) ? found : [];
    } catch {
        return [];
    }
}

function save() {
    saving = 0;
    try {
        sessionStorage.setItem(KEY, JSON.stringify(entries));
    } catch { /* a browser that keeps nothing begins anew every time */ }
}

const GOOD_NEWS = ["homed", "recovered"];
const BAD_STATES = ["interrupted", "failed", "red"];

// The level of what is worth telling; null: it is not.
function level(kind, data) {
    switch (kind) {
    case "state":
        return BAD_STATES.includes(data.state) ? "bad" : data.state === "done" ? "good" : data.state === "paused" ? "warn" : "info";
    case "check":
        return data.verdict === "red" && !data.overridden ? "bad" : data.verdict === "yellow" ? "warn" : null;
    case "shot":
        return data.lost ? "warn" : null;
    case "frame": // one that does not come is told as an incident too
        return ["f", "c", "r"].includes(data.letter ?? (data.state === "rejected" ? "r" : "")) ? "warn" : null;
    case "incident": // a lost shot is told as one too
        return data.what === "lost" ? null : GOOD_NEWS.includes(data.what) ? "info" : "warn";
    case "sealed":
        return "good";
    case "gap":
        return "info";
    case "processing":
        return data.state === "failed" ? "bad" : data.state === "done" ? "good" : null;
    case "verify":
        return data.state === "bad" ? "bad" : data.state === "good" ? "good" : null;
    case "deleted":
        return "info";
    case "ingest":
        return data.text ? "warn" : null;
    default:
        return null;
    }
}

const kindOf = (letter) => KINDS.find((kind) => kind.letter === letter)?.name ?? "rejected";
const last = (path) => String(path ?? "").split("/").filter(Boolean).pop() ?? "";

// What it is in the page's language; lumid's own line after it has the figures.
function incidentWords({ what, camera, text }) {
    const key = `incident.${what}`;

    if (what && has(key))
        return t(camera ? "event.incident.camera" : "event.incident", { camera, what: t(key), text });
    return camera ? t("event.camera", { camera, text }) : text;
}

export function entryWords({ kind, data }) {
    switch (kind) {
    case "state":
        return t(data.text ? "event.state.text" : "event.state", { state: stateWord(data.state), text: saidWords(data.text) });
    case "check":
        return t("event.check", { check: checkTitle(data.name), reason: data.reason });
    case "shot":
        return t("event.shot.lost", { shot: String(data.shot) });
    case "frame":
        return t("event.frame", { shot: String(data.shot), camera: data.camera, kind: t(`kind.${kindOf(data.letter)}`), text: data.text ?? "" });
    case "incident":
        return incidentWords(data);
    case "sealed":
        return t("event.sealed", { capture: last(data.text) });
    case "gap":
        return t("event.gap", { n: data.lost });
    case "processing":
        return t(`event.processing.${data.state}`, { capture: last(data.capture), text: data.text });
    case "verify":
        return t(`event.verify.${data.state}`, { capture: last(data.capture), text: data.text ?? "" });
    case "deleted":
        return t("event.deleted", { capture: last(data.capture ?? data.text) });
    default:
        return t("event.ingest", { capture: last(data.source), text: data.text ?? "" });
    }
}

const told = new Set(entries.map((entry) => entry.id).filter(Boolean));

stream.on("*", ({ kind, data, id }) => {
    const found = level(kind, data);

    if (!found || (id && told.has(id)))
        return; // sent again after a reconnection
    if (id)
        told.add(id);
    const newest = entries[0];
    const entry = { id, kind, level: found, data, time: data.time ?? new Date().toISOString(), number: (newest?.number ?? 0) + 1 };
    // What goes on is told again and again while a state lasts: the same words once.
    if (newest && newest.kind === kind && kind === "state" && newest.data.state === data.state && newest.data.text === data.text)
        return;
    entries = [entry, ...entries].slice(0, KEPT);
    saving ||= setTimeout(save, SAVE_MS);
    listeners.forEach((call) => call(entry));
});

export function onEntry(call) {
    listeners.add(call);
    return () => listeners.delete(call);
}
