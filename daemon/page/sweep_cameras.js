// Each camera in a sweep: its last frame with sharpness, histogram and clipping, and what it has lost or sent late.
import { drawHistogram } from "./histogram.js";
import { h, setText } from "./dom.js";
import { t } from "./i18n.js";
import { ImageQueue, onPictures, pictures } from "./camera_pictures.js";
import { store } from "./store.js";
import { percent } from "./words_live.js";

// What /api/v1/status counts of a camera and is no good news.
const COUNTERS = ["dropped", "late", "doubled", "out_of_order", "frames_damaged", "packets_missing"];
const CLIPPED_MUCH = 0.02;

class Card {
    constructor(name, seen) {
        this.name = name;
        this.image = h("img", { test: "camera-picture", alt: "", width: "160", height: "120", hidden: true, decoding: "async" });
        this.none = h("p", { class: "no-picture" }, t("camera.noPicture"));
        this.there = h("span", { class: "badge" });
        this.shot = h("p", { class: "camera-shot" });
        this.sharpness = h("dd", { test: "camera-sharpness" });
        this.low = h("dd", {});
        this.high = h("dd", {});
        this.histogram = h("canvas", { class: "histogram", role: "img", "aria-label": t("camera.histogram", { name }) });
        this.counters = h("p", { class: "camera-counters", test: "camera-counters" });
        this.element = h("article", { class: "camera card", test: "camera", data: { name }, "aria-label": t("camera.label", { name }) },
            h("div", { class: "row head" }, h("h3", {}, name), this.there),
            h("div", { class: "picture" }, this.none, this.image), this.shot,
            h("dl", { class: "figures" }, h("div", {}, h("dt", {}, t("camera.sharpness")), this.sharpness),
                h("div", {}, h("dt", {}, t("camera.low")), this.low), h("div", {}, h("dt", {}, t("camera.high")), this.high)),
            this.histogram, this.counters);
        seen.observe(this.element);
    }

    // The picture and its figures.
    show(queue) {
        const camera = pictures.cameras.get(this.name), last = camera?.last;

        if (!last) {
            for (const element of [this.sharpness, this.low, this.high])
                setText(element, "–");
            this.histogram.hidden = true;
            setText(this.none, pictures.absent ? t("camera.absent") : t("camera.noPicture"));
            return;
        }
        setText(this.sharpness, Number.isFinite(last.sharpness) ? percent(last.sharpness, 0) : "–");
        setText(this.low, percent(last.clipped_low));
        setText(this.high, percent(last.clipped_high));
        this.high.parentElement.classList.toggle("much", last.clipped_high > CLIPPED_MUCH);
        this.low.parentElement.classList.toggle("much", last.clipped_low > CLIPPED_MUCH);
        setText(this.shot, last.shot !== null ? t("camera.shot", { shot: String(last.shot) }) : t("camera.test"));
        this.image.alt = t("camera.alt", { name: this.name, shot: String(last.shot) });
        if (!this.visible)
            return;
        this.histogram.hidden = !last.histogram?.length;
        if (last.histogram?.length)
            drawHistogram(this.histogram, last.histogram);
        queue.want(this.image, `/api/v1/cameras/${encodeURIComponent(this.name)}/last.jpg?v=${last.number}`);
    }

    count(status) {
        const said = COUNTERS.filter((name) => status?.[name] > 0).map((name) => t(`camera.${name}`, { n: status[name] }));

        setText(this.there, status ? t(status.there ? "camera.there" : "camera.away") : "");
        this.there.dataset.kind = status?.there ? "good" : "bad";
        this.element.classList.toggle("away", status ? !status.there : false);
        setText(this.counters, said.length ? said.join(", ") : t("camera.fine", { n: status?.matched ?? 0 }));
        this.counters.classList.toggle("bad", said.length > 0);
    }
}

// c2 before c10.
export function byName(a, b) {
    return a.localeCompare(b, "en", { numeric: true });
}

export function insertByName(list, element) {
    const after = [...list.children].find((other) => byName(other.dataset.name, element.dataset.name) > 0);

    list.insertBefore(element, after ?? null);
}

// {element, destroy}
export function sweepCameras() {
    const queue = new ImageQueue(), cards = new Map(), list = h("div", { class: "cameras" });
    const seen = new IntersectionObserver((entries) => entries.forEach((entry) => {
        const card = cards.get(entry.target.dataset.name);
        card.visible = entry.isIntersecting;
        if (entry.isIntersecting)
            card.show(queue);
    }), { rootMargin: "100px" });

    const all = () => {
        const status = store.get("cameras") ?? [];
        for (const name of new Set([...status.map((one) => one.name), ...pictures.cameras.keys()])) {
            if (!cards.has(name)) {
                cards.set(name, new Card(name, seen));
                insertByName(list, cards.get(name).element);
            }
            cards.get(name).count(status.find((one) => one.name === name));
        }
    };
    const show = (name) => {
        all();
        for (const card of name ? [cards.get(name)] : cards.values())
            card.show(queue);
    };
    all();
    const offs = [store.on("cameras", all), onPictures(show)];
    return {
        element: h("section", { "aria-labelledby": "cameras-title" }, h("h2", { id: "cameras-title" }, t("cameras.title")), list),
        destroy() {
            offs.forEach((off) => off());
            seen.disconnect();
            queue.clear();
        },
    };
}
