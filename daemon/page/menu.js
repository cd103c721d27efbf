// The header's menu: who one is, language, theme, pairing, logging out.
import { fill, h } from "./dom.js";
import { currentLanguage, LANGUAGES, setLanguage, t } from "./i18n.js";
import { logOut, openPair, sessionsOffered } from "./login.js";
import { kept, store } from "./store.js";
import { errorWords } from "./words.js";

const THEMES = ["auto", "dark", "bright"];

let unfollow = null;

export function applyTheme() {
    document.documentElement.dataset.theme = kept.get("theme", "auto");
}

function select(label, test, options, value, change) {
    return h("label", { class: "field" }, h("span", {}, label),
        h("select", { test, value, on: { change: (event) => change(event.target.value) } },
            options.map(([name, text]) => h("option", { value: name }, text))));
}

function account(session) {
    const you = session?.you;

    if (!you)
        return [];
    return [
        h("p", {}, t("menu.you", { name: you.via === "local" ? t("menu.here") : you.name, role: t(`role.${you.role}`) })),
        sessionsOffered() && you.role === "operate" &&
            h("button", { type: "button", test: "pair", on: { click: openPair } }, t("pair.title")),
        session.users && you.via !== "local" && h("button", { type: "button", test: "logout", on: { click: (event) =>
            logOut().catch((error) => event.target.after(h("p", { class: "notice", data: { kind: "bad" } },
                errorWords(error)))) } }, t("menu.logout")),
    ];
}

function name(session) {
    const you = session?.you;

    return you ? (you.via === "local" ? t("menu.here") : you.name) : t("menu.nobody");
}

export function mountMenu(root) {
    const who = h("span", { test: "who" });
    const mine = h("div", { class: "stack" });
    const details = h("details", { class: "menu", on: { keydown: (event) => {
        if (event.key === "Escape" && details.open) {
            details.open = false;
            details.querySelector("summary").focus();
        }
    }, click: (event) => {
        if (event.target.closest("button"))
            details.open = false;
    } } },
    h("summary", { test: "menu" }, h("span", { class: "icon icon-person", "aria-hidden": "true" }), who),
    h("div", { class: "stack panel" }, mine,
        select(t("menu.language"), "language", Object.entries(LANGUAGES), currentLanguage(), setLanguage),
        select(t("menu.theme"), "theme", THEMES.map((one) => [one, t(`theme.${one}`)]), kept.get("theme", "auto"),
            (value) => {
                kept.set("theme", value);
                applyTheme();
            }),
        h("p", { class: "why" }, `${t("estop.button")}: ${t("estop.help")}`)));
    const show = (session) => {
        who.textContent = name(session);
        fill(mine, account(session));
    };

    applyTheme();
    unfollow?.();
    unfollow = store.on("session", show);
    show(store.get("session"));
    fill(root, details);
}
