// The captures on the disk.
import { captures, fetchCaptures, onCaptures } from "./captures_list.js";
import { CaptureCard } from "./capture_card.js";
import { ImageQueue } from "./camera_pictures.js";
import { h, setText } from "./dom.js";
import { bytes, t } from "./i18n.js";
import { store } from "./store.js";
import { errorWords } from "./words.js";

let offs = [];

export const view = {
    name: "captures",

    mount(root) {
        const cards = new Map(), queue = new ImageQueue(), list = h("div", { class: "captures" });
        const said = h("p", { class: "captures-said", role: "status" }), error = h("p", { class: "notice", data: { kind: "bad" }, hidden: true });
        const update = () => {
            const names = new Set(captures.list.map((one) => one.name));
            for (const [name, card] of cards) {
                if (!names.has(name)) {
                    card.element.remove();
                    cards.delete(name);
                }
            }
            captures.list.forEach((capture, i) => {
                const card = cards.get(capture.name) ?? new CaptureCard(capture.name, queue);
                cards.set(capture.name, card);
                card.show(capture);
                if (list.children[i] !== card.element)
                    list.insertBefore(card.element, list.children[i] ?? null);
            });
            const size = captures.list.reduce((sum, one) => sum + (one.bytes || 0), 0);
            setText(said, !captures.asked ? t("captures.asking") : captures.list.length
                ? t("captures.said", { n: captures.list.length, size: bytes(size), free: bytes(store.get("disk")?.disk_free_bytes) })
                : captures.error ? "" : t("captures.none"));
            error.hidden = !captures.error;
            setText(error, captures.error ? errorWords(captures.error) : "");
        };
        root.append(h("h1", {}, t("nav.captures")), said, error, list,
            h("div", { class: "row wrap" }, h("button", { type: "button", on: { click: fetchCaptures } }, t("captures.again"))));
        offs = [onCaptures(update), store.on(["session", "capture", "disk"], update), () => queue.clear()];
        update();
    },

    unmount() {
        offs.forEach((off) => off());
        offs = [];
    },
};
