// One capture on the disk: what it is, whether it is whole, and what can be done with it.
import { captures, baseName, verifying } from "./captures_list.js";
import { deleteCapture, handOver, retakeMissing, verify } from "./capture_deeds.js";
import { RESTING } from "./control.js";
import { h, newId, setText } from "./dom.js";
import { bytes, dateTime, t } from "./i18n.js";
import { mayOperate, store } from "./store.js";
import { noticeBox } from "./words.js";

export function missingOf(capture) {
    const { planned = 0, triggered = 0, rejected = 0 } = capture.in_state ?? {};

    return planned + triggered + rejected;
}

function progress(test) {
    const bar = h("progress", { max: "1" }), said = h("span", {});
    const element = h("p", { class: "deed", test, hidden: true }, h("label", {}, said, bar));

    return { element, set(text, share, kind = "") {
        element.hidden = !text;
        element.dataset.kind = kind;
        setText(said, text);
        bar.hidden = share === null;
        if (share === undefined || !Number.isFinite(share))
            bar.removeAttribute("value");
        else
            bar.value = share;
    } };
}

// `isNow`: it is the capture under way.
function stateOf(capture, isNow) {
    const missing = missingOf(capture);

    if (capture.error)
        return ["bad", t("capture.broken", { text: capture.error })];
    if (isNow)
        return ["info", t("capture.now")];
    if (!capture.sealed)
        return ["warn", t("capture.open", { n: missing })];
    return missing ? ["warn", t("capture.incomplete", { n: missing })] : ["good", t("capture.complete")];
}

export class CaptureCard {
    constructor(name, queue) {
        const id = newId("capture"), button = (deed, call) => h("button", { type: "button", test: `capture-${deed}`,
            "aria-describedby": id, on: { click: () => call(this.capture, this.notice) } }, t(`capture.${deed}`));

        this.queue = queue;
        this.title = h("h2", { id }, name);
        this.image = h("img", { alt: "", width: "240", height: "160", hidden: true, decoding: "async" });
        this.facts = h("p", { class: "capture-facts" });
        this.state = h("p", { class: "capture-state", test: "capture-state" });
        this.checked = progress("capture-verified");
        this.processed = progress("capture-processed");
        this.buttons = { verify: button("verify", verify), process: button("process", handOver), retake: button("retake", retakeMissing),
            delete: button("delete", deleteCapture) };
        this.buttons.delete.classList.add("caution");
        this.download = h("a", { class: "button", test: "capture-download", download: `${name}.tar`, "aria-describedby": id,
            href: `/api/v1/captures/${encodeURIComponent(name)}/bundle.tar` }, t("capture.download"));
        this.why = h("p", { class: "why" });
        this.notice = noticeBox("capture-notice");
        const { verify: check, process, retake, delete: remove } = this.buttons;
        this.element = h("article", { class: "card capture", test: "capture", data: { name }, "aria-labelledby": id },
            h("div", { class: "picture" }, h("p", { class: "no-picture" }, t("capture.noPicture")), this.image),
            h("div", { class: "capture-words" }, this.title, this.facts, this.state, this.checked.element, this.processed.element,
                h("div", { class: "row wrap" }, check, process, retake, this.download, remove), this.why, this.notice.element));
    }

    show(capture) {
        const isNow = baseName(store.get("capture")?.path) === capture.name && !RESTING.includes(store.get("capture")?.state);
        const [kind, words] = stateOf(capture, isNow);

        this.capture = capture;
        setText(this.title, capture.title || capture.name);
        setText(this.facts, t(capture.title ? "capture.facts.title" : "capture.facts", { name: capture.name, created: dateTime(capture.created),
            shots: capture.shots, frames: capture.frames, size: bytes(capture.bytes) }));
        setText(this.state, words);
        this.state.dataset.kind = kind;
        Object.assign(this.element.dataset, { sealed: String(capture.sealed), missing: String(missingOf(capture)),
            verified: capture.verified ? String(capture.verified.good) : "" });
        this.image.alt = t("capture.alt", { name: capture.title || capture.name });
        if (capture.thumbnail)
            this.queue.want(this.image, `/api/v1/captures/${encodeURIComponent(capture.name)}/thumbnail.jpg`);
        this.showVerified(capture);
        this.showProcessed(capture);
        this.showButtons(capture, isNow);
    }

    showVerified(capture) {
        const now = verifying.get(capture.name);

        this.running = now?.state === "running";
        if (now && !this.running && this.told !== now)
            this.notice.clear(); // what was begun has ended: the line above says how
        this.told = now;
        if (this.running)
            this.checked.set(t("verify.running", { done: bytes(now.done), all: bytes(now.total) }), now.total ? now.done / now.total : NaN);
        else if (now && !capture.verified)
            this.checked.set(t(`verify.${now.state}`, { time: "", text: now.text }), null, now.state);
        else if (capture.verified)
            this.checked.set(t(capture.verified.good ? "verify.good" : "verify.bad", { time: dateTime(capture.verified.time),
                text: capture.verified.text }), null, capture.verified.good ? "good" : "bad");
        else
            this.checked.set(t("verify.never"), null);
    }

    showProcessed(capture) {
        const found = captures.processing.find((one) => baseName(one.capture) === capture.name);

        this.processing = found && (found.state === "running" || found.state === "waiting");
        if (!found)
            this.processed.set("", null);
        else
            this.processed.set(t(`processing.${found.state}`, { stage: found.stage || "", text: found.text || "" }),
                found.state === "running" ? found.progress ?? NaN : found.state === "waiting" ? NaN : null,
                found.state === "done" ? "good" : found.state === "failed" ? "bad" : "");
    }

    // The first reason why something cannot be pressed stands below.
    showButtons(capture, isNow) {
        const watch = mayOperate() ? "" : t("capture.why.watch"), busy = isNow ? t("capture.why.now") : "";
        const resting = RESTING.includes(store.get("capture")?.state);
        const why = {
            verify: watch || busy || (this.running ? t("capture.why.verifying") : !capture.sealed ? t("capture.why.open") : ""),
            process: watch || busy || (!captures.configured ? t("capture.why.noProcess") : !capture.sealed ? t("capture.why.open")
                : this.processing ? t("capture.why.processing") : ""),
            retake: watch || busy || (!missingOf(capture) ? t("capture.why.nothing") : resting ? "" : t("capture.why.other")),
            delete: watch || busy || (this.running || this.processing ? t("capture.why.used") : ""),
        };

        for (const [name, button] of Object.entries(this.buttons)) {
            button.disabled = why[name] !== "";
            button.title = why[name];
        }
        this.buttons.retake.hidden = !missingOf(capture);
        this.download.hidden = isNow || !capture.sealed;
        setText(this.why, watch || busy || (!captures.configured ? why.process : ""));
    }
}
