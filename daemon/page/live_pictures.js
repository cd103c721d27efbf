// Moving pictures of the cameras (MJPEG), only while they can be seen: a browser has six connections to lumid, the events
// need one, and an emergency stop must always find one free. So at most LIVE_MOST move at once, one on a phone.
import { LIVE_MOST } from "./api.js";
import { onPictures, pictures } from "./camera_pictures.js";
import { h, setText } from "./dom.js";
import { t } from "./i18n.js";
import { store } from "./store.js";
import { byName, insertByName } from "./sweep_cameras.js";
import { percent } from "./words_live.js";

const PHONE = "(max-width: 700px)";

function most() {
    return matchMedia(PHONE).matches ? 1 : LIVE_MOST;
}

class Tile {
    constructor(name, toggle) {
        this.name = name;
        this.wanted = false;
        this.visible = false;
        this.image = h("img", { alt: "", hidden: true, width: "320", height: "240", decoding: "async" });
        this.none = h("p", { class: "no-picture" });
        this.button = h("button", { type: "button", "aria-pressed": "false", test: "live-toggle", on: { click: () => toggle(this) } });
        this.figures = h("p", { class: "camera-shot" });
        this.element = h("article", { class: "card live", test: "live", data: { name, live: "off" }, "aria-label": t("camera.label", { name }) },
            h("div", { class: "row head" }, h("h3", {}, name), this.button),
            h("div", { class: "picture" }, this.none, this.image), this.figures);
        this.image.addEventListener("load", () => {
            this.image.hidden = false;
            this.failed = false;
        });
        this.image.addEventListener("error", () => {
            if (!this.source)
                return;
            this.image.hidden = true;
            this.failed = true;
            this.words();
        });
        this.words();
    }

    // The one address or none: an image that has no source has no connection either.
    show(on) {
        const last = pictures.cameras.get(this.name)?.last, stem = `/api/v1/cameras/${encodeURIComponent(this.name)}`;
        const source = on ? `${stem}/live` : this.visible && last ? `${stem}/last.jpg?v=${last.number}` : "";

        this.element.dataset.live = on ? "on" : "off";
        if (source !== this.source) {
            this.source = source;
            this.failed = false;
            if (source)
                this.image.src = source;
            else
                this.image.removeAttribute("src");
            this.image.hidden ||= !source;
        }
        this.words();
    }

    words() {
        const camera = pictures.cameras.get(this.name), last = camera?.last;

        setText(this.button, t(this.wanted ? "live.off" : "live.on"));
        this.button.setAttribute("aria-pressed", String(this.wanted));
        this.image.alt = t(this.wanted ? "live.alt" : "live.alt.last", { name: this.name });
        setText(this.none, pictures.absent ? t("camera.absent") : camera && !camera.there ? t("live.away")
            : this.failed ? t("live.failed") : this.wanted ? t("live.waiting") : t("camera.noPicture"));
        setText(this.figures, Number.isFinite(last?.sharpness) ? t("live.figures", { sharpness: percent(last.sharpness, 0) }) : "");
    }
}

class Tiles {
    constructor() {
        this.tiles = new Map();
        this.stopped = false;
        this.list = h("div", { class: "lives" });
        this.said = h("p", { class: "hint", role: "status" });
        this.seen = new IntersectionObserver((entries) => {
            for (const entry of entries)
                this.tiles.get(entry.target.dataset.name).visible = entry.isIntersecting;
            this.update();
        }, { threshold: 0.2 });
    }

    // Whoever wants a third one more gives up the one longest watched.
    toggle(tile) {
        this.stopped = false;
        tile.wanted = !tile.wanted;
        this.order = [...(this.order ?? []).filter((one) => one !== tile), ...(tile.wanted ? [tile] : [])];
        while (this.order.length > most())
            this.order.shift().wanted = false;
        this.update();
    }

    fill() {
        for (const name of [...pictures.cameras.keys()].sort(byName)) {
            if (this.tiles.has(name))
                continue;
            const tile = new Tile(name, (one) => this.toggle(one));
            this.tiles.set(name, tile);
            insertByName(this.list, tile.element);
            this.seen.observe(tile.element);
        }
        if (pictures.fetched && !this.order && this.tiles.size)
            this.toggle(this.tiles.get(this.list.firstChild.dataset.name)); // the first moves without being asked
        this.update();
    }

    update() {
        const asleep = document.hidden || this.stopped || store.get("connection").state === "lost";

        for (const tile of this.tiles.values())
            tile.show(tile.wanted && tile.visible && !asleep && !pictures.absent);
        setText(this.said, pictures.absent ? t("camera.absent") : !this.tiles.size ? t("live.none")
            : this.stopped ? t("live.stopped") : t("live.most", { n: most() }));
    }

    end() {
        this.seen.disconnect();
        for (const tile of this.tiles.values())
            tile.show(false);
        for (const tile of this.tiles.values())
            tile.image.removeAttribute("src");
    }
}

// {element, destroy}
export function livePictures() {
    const tiles = new Tiles(), stop = new AbortController(), { signal } = stop;
    const offs = [onPictures(() => tiles.fill()), store.on("connection", () => tiles.update())];

    document.addEventListener("visibilitychange", () => tiles.update(), { signal });
    document.addEventListener("lumi-estop", () => {
        tiles.stopped = true;
        tiles.update();
    }, { signal });
    tiles.fill();
    return {
        element: h("section", { "aria-labelledby": "live-title" }, h("h2", { id: "live-title" }, t("live.title")), tiles.said, tiles.list),
        destroy() {
            offs.forEach((off) => off());
            stop.abort();
            tiles.end();
        },
    };
}
