// Last pictures of the cameras: kept by events, fetched for those that can be seen, two at a time, the newest only.
import { get } from "./api.js";
import { store } from "./store.js";
import * as stream from "./stream.js";

const AT_ONCE = 2; // of the browser's six connections to lumid

// name → {there, live, last}; `fetched`: all of them are known; `absent`: this lumid has no pictures.
export const pictures = { cameras: new Map(), fetched: false, absent: false, error: null };
const listeners = new Set();
let started = false;

async function fetchCameras() {
    try {
        const found = await get("/api/v1/cameras", { quiet: true });
        pictures.cameras = new Map(found.cameras.map((camera) => [camera.name, camera]));
        pictures.absent = false;
        pictures.fetched = true;
        pictures.error = null;
    } catch (error) {
        pictures.absent = error.word === "absent";
        pictures.error = error;
        pictures.cameras = new Map((store.get("cameras") ?? []).map(({ name, there }) => [name, { name, there, live: false, last: null }]));
    }
    listeners.forEach((call) => call(null));
}

// `call(name)`: this camera has a new picture; null: look at all of them.
export function onPictures(call) {
    listeners.add(call);
    if (!started) {
        started = true;
        stream.on("picture", (data) => {
            const known = pictures.cameras.get(data.camera) ?? { name: data.camera, there: true, live: true };
            pictures.cameras.set(data.camera, { ...known, last: data });
            listeners.forEach((one) => one(data.camera));
        });
        stream.on("open", fetchCameras);
    }
    fetchCameras();
    return () => listeners.delete(call);
}

// Loads images one after another. wants(image, url): the last url counts.
export class ImageQueue {
    constructor() {
        this.waiting = new Map();
        this.under = 0;
    }

    want(image, url) {
        if (image.dataset.wanted === url)
            return;
        image.dataset.wanted = url;
        this.waiting.set(image, url);
        this.next();
    }

    next() {
        while (this.under < AT_ONCE && this.waiting.size) {
            const [image, url] = this.waiting.entries().next().value;
            const done = new AbortController();
            this.waiting.delete(image);
            this.under++;
            const end = (well) => {
                done.abort();
                clearTimeout(timer);
                image.classList.toggle("failed", !well);
                image.hidden = !well;
                this.under--;
                this.next();
            };
            const timer = setTimeout(() => end(false), 10000);
            image.addEventListener("load", () => end(true), { signal: done.signal });
            image.addEventListener("error", () => end(false), { signal: done.signal });
            image.src = url;
        }
    }

    clear() {
        this.waiting.clear();
    }
}
