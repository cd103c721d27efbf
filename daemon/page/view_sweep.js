// The sweep as it goes: sphere, progress, cameras, events.
import { h } from "./dom.js";
import { t } from "./i18n.js";
import { sphereView } from "./sphere_view.js";
import { sweepCameras } from "./sweep_cameras.js";
import { sweepEvents } from "./sweep_events.js";
import { sweepProgress } from "./sweep_progress.js";

let parts = [];

export const view = {
    name: "sweep",

    mount(root) {
        const sphere = sphereView(), progress = sweepProgress(), cameras = sweepCameras(), events = sweepEvents();

        parts = [sphere, progress, cameras, events];
        root.append(h("h1", { class: "hidden" }, t("nav.sweep")), h("div", { class: "sweep" },
            h("div", { class: "sweep-left" }, sphere.element),
            h("div", { class: "sweep-right" }, progress.element, sphere.words, events.element),
            h("div", { class: "sweep-below" }, cameras.element)));
    },

    unmount() {
        parts.forEach((part) => part.destroy());
        parts = [];
    },
};
