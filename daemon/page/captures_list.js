// What is known of the captures on the disk: fetched, and kept up by events. One for the page.
import { get } from "./api.js";
import { store } from "./store.js";
import * as stream from "./stream.js";

const AGAIN_MS = 500;

export const captures = { folder: "", list: [], processing: [], configured: false, error: null, asked: false };
export const verifying = new Map(); // name → {state, done, total, text}

const listeners = new Set();
let started = false, timer = 0;

export function baseName(path) {
    return String(path ?? "").split("/").filter(Boolean).pop() ?? "";
}

function tell() {
    listeners.forEach((call) => call());
}

export async function fetchCaptures() {
    clearTimeout(timer);
    timer = 0;
    try {
        const found = await get("/api/v1/captures", { quiet: true, patience: 60000 });
        captures.folder = found.folder;
        captures.list = found.captures;
        captures.error = null;
    } catch (error) {
        captures.error = error;
    }
    captures.asked = true;
    tell();
}

async function fetchProcessing() {
    try {
        const found = await get("/api/v1/processing", { quiet: true });
        captures.configured = found.configured;
        captures.processing = found.processing;
        tell();
    } catch { /* what is known stays */ }
}

export function fetchSoon() {
    timer ||= setTimeout(fetchCaptures, AGAIN_MS);
}

// The newest first, as lumid lists them.
function onProcessing(data) {
    captures.processing = [data, ...captures.processing.filter((one) => one.capture !== data.capture)];
    tell();
}

function onVerify(data) {
    const name = baseName(data.capture);

    verifying.set(name, data);
    if (data.state !== "running")
        fetchSoon();
    tell();
}

export function onCaptures(call) {
    listeners.add(call);
    if (!started) {
        let state = null;
        started = true;
        stream.on("processing", onProcessing);
        stream.on("verify", onVerify);
        for (const kind of ["sealed", "deleted", "ingest", "gap"])
            stream.on(kind, fetchSoon);
        stream.on("open", () => {
            fetchSoon();
            fetchProcessing();
        });
        store.on("capture", (capture) => {
            if (state !== capture?.state && listeners.size)
                fetchSoon();
            state = capture?.state;
        });
    }
    fetchCaptures();
    fetchProcessing();
    return () => listeners.delete(call);
}
