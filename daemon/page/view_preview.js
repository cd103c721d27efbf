// What can be seen now: the light field so far, and the cameras' moving pictures.
import { h } from "./dom.js";
import { FieldView } from "./field_view.js";
import { t } from "./i18n.js";
import { livePictures } from "./live_pictures.js";

let parts = [];

export const view = {
    name: "preview",

    mount(root) {
        const field = new FieldView(), live = livePictures();

        parts = [field, live];
        root.append(h("h1", { class: "hidden" }, t("nav.preview")), field.element, live.element);
    },

    unmount() {
        parts.forEach((part) => part.destroy());
        parts = [];
    },
};
