// Who else is connected: asked for freshly before anything moves, and shown there.
import { get } from "./api.js";
import { fill, h } from "./dom.js";
import { t } from "./i18n.js";
import { store } from "./store.js";

export function personWords(person) {
    return t(person.you ? "people.you" : "people.one", { name: person.name, role: t(`role.${person.role}`),
        address: person.address ?? "" });
}

function list(people) {
    const others = people.filter((one) => !one.you);

    if (!others.length)
        return h("p", {}, t("people.alone"));
    return [h("p", {}, h("strong", {}, t("people.others", { n: others.length }))),
        h("ul", {}, others.map((one) => h("li", {}, personWords(one))))];
}

// An element that fills itself.
export function peopleNow() {
    const element = h("div", { class: "people", test: "dialog-people", "aria-live": "polite" }, t("people.asking"));

    get("/api/v1/session/people", { patience: 3000, quiet: true }).then(({ people }) => {
        store.set("people", people);
        fill(element, list(people));
    }, (error) => {
        const known = store.get("people");

        fill(element, error.word === "absent" ? t("people.absent") : known.length ? list(known) : t("people.unknown"));
    });
    return element;
}
