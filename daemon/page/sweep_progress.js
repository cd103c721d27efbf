// How far the capture is, how long it will take, and what the disk says to it.
import { h, setText } from "./dom.js";
import { bytes, number, t } from "./i18n.js";
import { store } from "./store.js";
import { aboutTime } from "./words_live.js";

const AT_WORK = ["homing", "arming", "sweeping", "pausing", "paused", "interrupted", "draining"];
const HOT = 60;

function figure(label, test) {
    const value = h("dd", { test }), note = h("dd", { class: "note" });
    const element = h("div", {}, h("dt", {}, label), value, note);

    return { element, set(text, more = "", kind = "") {
        setText(value, text);
        setText(note, more);
        element.dataset.kind = kind;
    } };
}

function bar() {
    const parts = ["good", "stored", "bad"].map((name) => h("span", { class: `part part-${name}` }));
    const element = h("div", { class: "bar", role: "progressbar", "aria-valuemin": "0", "aria-label": t("progress.label"), test: "progress" },
        parts);

    return { element, set(values, all, text) {
        values.forEach((value, i) => parts[i].style.setProperty("width", all ? `${100 * value / all}%` : "0"));
        element.setAttribute("aria-valuemax", String(Math.max(1, all)));
        element.setAttribute("aria-valuenow", String(values[0]));
        element.setAttribute("aria-valuetext", text);
        Object.assign(element.dataset, { good: values[0], stored: values[1], bad: values[2], frames: all });
    } };
}

function hottest(cameras) {
    return cameras.filter((one) => Number.isFinite(one.temperature))
        .reduce((most, one) => (!most || one.temperature > most.temperature ? one : most), null);
}

function writeDisk(disk, rate, capture, store_) {
    const free = capture.disk_free_bytes ?? store_?.disk_free_bytes, writes = capture.bytes_per_second ?? store_?.bytes_per_second;
    const left = capture.disk_seconds_left ?? (free > 0 && writes > 0 ? free / writes : null);
    const short = left !== null && capture.seconds_left > 0 && left < capture.seconds_left;

    disk.set(bytes(free), left === null ? "" : t(short ? "disk.short" : "disk.lasts", { time: aboutTime(left) }), short ? "bad" : "");
    rate.set(writes === null || writes === undefined ? t("unknown") : t("rate.value", { bytes: bytes(writes) }),
        store_?.waiting_bytes > 0 ? t("rate.waiting", { bytes: bytes(store_.waiting_bytes) }) : "");
}

// {element, destroy}
export function sweepProgress() {
    const line = bar(), said = h("p", { class: "progress-said", test: "progress-said" });
    const round = figure(t("progress.round"), "round"), time = figure(t("progress.time"), "time-left");
    const disk = figure(t("progress.disk"), "disk-left"), rate = figure(t("progress.rate"), "rate");
    const shots = figure(t("progress.shots"), "shots"), heat = figure(t("progress.heat"), "temperature");

    const update = () => {
        const capture = store.get("capture"), warm = hottest(store.get("cameras") ?? []);
        if (!capture)
            return;
        const bad = (capture.rejected ?? 0) + (capture.missing ?? 0), good = capture.accepted ?? 0, stored = capture.stored ?? 0;
        const words = capture.frames ? t("progress.frames", { good, all: capture.frames, bad, stored }) : t("progress.none");
        line.set([good, stored, bad], capture.frames ?? 0, words);
        setText(said, words);
        round.set(capture.frames ? capture.round > 0 ? t("progress.retake", { n: capture.round }) : t("progress.sweep") : "–");
        time.set(AT_WORK.includes(capture.state) ? aboutTime(capture.seconds_left) : "–");
        shots.set(capture.shots ? t("progress.of", { done: capture.fired, all: capture.shots }) : "–",
            capture.lost > 0 ? t("progress.lost", { n: capture.lost }) : "", capture.lost > 0 ? "warn" : "");
        heat.element.hidden = !warm;
        if (warm)
            heat.set(`${number(warm.temperature, 1)} °C`, warm.name, warm.temperature > HOT ? "warn" : "");
        writeDisk(disk, rate, capture, store.get("disk"));
    };
    const off = store.on(["capture", "cameras", "disk"], update);
    update();
    return {
        element: h("section", { class: "progress", "aria-labelledby": "progress-title" }, h("h2", { id: "progress-title" }, t("progress.title")),
            line.element, said,
            h("dl", { class: "figures big" }, [time, disk, rate, shots, round, heat].map((one) => one.element))),
        destroy: off,
    };
}
