// The stream of events (docs/api.md), read by fetch rather than by EventSource: so the comments that say "still here"
// and the status of a refusal are seen, and the id of the last event outlives every new attempt.
import { get, problem } from "./api.js";
import { eventParser } from "./event_parser.js";
import { store } from "./store.js";

const SILENT_MS = 4000; // nothing heard for so long: lumid is asked whether it is there
const PROBE_MS = 4000;
const TRY_FIRST_MS = 500;
const TRY_MOST_MS = 8000;
const HIDDEN_MS = 60000; // a page nobody looks at gives its connection back

const listeners = new Map();
let wanted = false;
let running = false;
let abort = null;
let lastId = null;
let heard = 0;
let probing = false;
let wake = null;
let hiddenTimer = null;

// "open" and "lost" are told too; "open" after every (re)connection: what was missed is to be fetched.
export function on(name, call) {
    if (!listeners.has(name))
        listeners.set(name, new Set());
    listeners.get(name).add(call);
    return () => listeners.get(name).delete(call);
}

function emit(name, data, id) {
    for (const call of [...(listeners.get(name) ?? [])]) {
        try {
            call(data, id);
        } catch (error) {
            console.error(error); // one view's mistake does not take the events from the others
        }
    }
    if (name !== "*" && name !== "open" && name !== "lost")
        emit("*", { kind: name, data, id });
}

// `why`: what lumid said, where it refused.
function connection(state, why = "") {
    const before = store.get("connection");

    if (before.state === state && (before.why ?? "") === why)
        return;
    store.set("connection", { state, why, since: before.state === state ? before.since : new Date() });
    if (state !== "connecting" && state !== before.state)
        emit(state);
}

function told(kind, text, id) {
    let data;

    try {
        data = JSON.parse(text);
    } catch {
        return; // not lumid's
    }
    if (id !== undefined)
        lastId = id;
    emit(kind, data, id);
}

async function listen() {
    const headers = { Accept: "text/event-stream" };

    if (lastId)
        headers["Last-Event-ID"] = lastId;
    const mine = abort = new AbortController();
    const timer = setTimeout(() => mine.abort(), PROBE_MS * 2);
    const answer = await fetch("/api/v1/events", { headers, signal: mine.signal, cache: "no-store" })
        .finally(() => clearTimeout(timer));

    if (!answer.ok)
        throw await problem(answer);
    heard = Date.now();
    connection("open");
    const reader = answer.body.getReader();
    const decoder = new TextDecoder();
    const feed = eventParser(told);
    for (;;) {
        const { value, done } = await reader.read();
        if (done)
            return;
        heard = Date.now();
        feed(decoder.decode(value, { stream: true }));
    }
}

const pause = (ms) => new Promise((resolve) => {
    const timer = setTimeout(resolve, ms);

    wake = () => {
        clearTimeout(timer);
        resolve();
    };
});

async function run() {
    let wait = TRY_FIRST_MS;

    running = true;
    while (wanted) {
        let began = Date.now();
        let why = "";

        try {
            await listen();
        } catch (error) {
            if (error.status === 401) {
                connection("lost");
                // Asks for the login, in place; the stream goes on when there is a session again.
                await get("/api/v1/capture").then(() => {
                    began = 0; // at once
                }, () => {});
            } else if (error.status) {
                why = error.detail;
            }
        }
        abort = null;
        if (!wanted)
            break;
        connection("lost", why);
        wait = Date.now() - began > TRY_MOST_MS ? TRY_FIRST_MS : Math.min(wait * 2, TRY_MOST_MS);
        await pause(wait);
    }
    running = false;
}

async function probe() {
    if (!wanted || probing || !abort || store.get("connection").state !== "open")
        return;
    probing = true;
    try {
        await get("/api/v1/capture", { patience: PROBE_MS, quiet: true });
        heard = Date.now();
    } catch (error) {
        if (error.status === 0 && error.word !== "stopped")
            abort?.abort();
    }
    probing = false;
}

export function start() {
    if (wanted)
        return;
    wanted = true;
    heard = Date.now();
    if (!running)
        run();
}

export function stop() {
    wanted = false;
    abort?.abort();
    wake?.();
}

setInterval(() => {
    if (Date.now() - heard > SILENT_MS)
        probe();
}, 1000);

// "offline" says that there is no network, which is no matter for a lumid on this very computer: it is only asked.
for (const name of ["online", "offline"])
    addEventListener(name, () => {
        wake?.();
        probe();
    });

document.addEventListener("visibilitychange", () => {
    clearTimeout(hiddenTimer);
    if (document.hidden && wanted)
        hiddenTimer = setTimeout(() => {
            stop();
            connection("connecting");
        }, HIDDEN_MS);
    else if (!document.hidden && !wanted && store.get("session")?.you)
        start();
});
