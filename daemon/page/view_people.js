// Who is connected: name, role, from where, since when; and the way for one more phone.
import { get, post } from "./api.js";
import * as dialog from "./dialog.js";
import { fill, h, setText } from "./dom.js";
import { dateTime, t } from "./i18n.js";
import * as login from "./login.js";
import { mayOperate, store } from "./store.js";
import { errorWords, noticeBox } from "./words.js";

let off = null;

async function logOut(person, notice) {
    if (!await dialog.ask(t("people.logout.ask", { name: person.name }), h("p", {}, t("people.logout.what")), { confirm: t("people.logout") }))
        return;
    try {
        await post("/api/v1/session/revoke", { id: person.id });
        notice.say("good", t("people.logout.done", { name: person.name }));
    } catch (error) {
        notice.error(error);
    }
}

function row(person, notice) {
    const out = mayOperate() && person.id && !person.you ? h("button", { type: "button", test: "people-logout",
        "aria-label": `${t("people.logout")}: ${person.name}`, on: { click: () => logOut(person, notice) } }, t("people.logout")) : "";

    return h("tr", { data: { you: String(person.you), role: person.role } },
        h("th", { scope: "row" }, person.name, person.you ? ` (${t("people.this")})` : ""),
        h("td", {}, t(`role.${person.role}`)), h("td", {}, person.address || "–"), h("td", {}, dateTime(person.since)),
        h("td", {}, person.streams > 0 ? t("people.watching") : t("people.away")), h("td", {}, out));
}

async function ask(said) {
    try {
        store.set("people", (await get("/api/v1/session/people", { quiet: true })).people ?? []);
        setText(said, "");
    } catch (error) {
        setText(said, error.word === "absent" ? t("people.absent") : errorWords(error));
    }
}

export const view = {
    name: "people",

    mount(root) {
        const said = h("p", { class: "hint", role: "status" }), body = h("tbody", {});
        const table = h("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": t("people.title") },
            h("table", { test: "people" }, h("caption", { class: "hidden" }, t("people.title")),
                h("thead", {}, h("tr", {}, ["name", "role", "address", "since", "now"].map((name) =>
                    h("th", { scope: "col" }, t(`people.column.${name}`))), h("td", {}))), body));
        const notice = noticeBox("people-notice");
        const pair = h("button", { type: "button", class: "primary", test: "people-pair", on: { click: () => login.openPair() } }, t("people.pair"));
        const why = h("p", { class: "why" });
        const update = () => {
            const people = store.get("people") ?? [];
            fill(body, people.map((person) => row(person, notice)));
            table.hidden = people.length === 0;
            pair.disabled = !mayOperate();
            setText(why, mayOperate() ? "" : t("people.pair.watch"));
        };
        root.append(h("h1", {}, t("nav.people")), said, table, notice.element, h("div", { class: "row wrap" }, pair), why);
        off = store.on(["people", "session"], update);
        update();
        ask(said);
    },

    unmount() {
        off?.();
        off = null;
    },
};
