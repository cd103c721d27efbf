// lumid's words into words for a crew: states, verdicts, checks, and what went wrong with what to do about it.
import { has, t } from "./i18n.js";
import { h } from "./dom.js";

const NOTICE_MS = 5000;

export const ICONS = { green: "✔", yellow: "!", red: "✖", undecided: "…" };

export function stateWord(state) {
    return has(`state.${state}`) ? t(`state.${state}`) : state;
}

// What the engine says of its state, where that is one of its fixed sentences; others are shown as they are.
export function saidWords(text) {
    const key = `said.${String(text ?? "").toLowerCase().replace(/[^a-z0-9]+/g, "-").replace(/^-|-$/g, "")}`;

    return has(key) ? t(key) : text ?? "";
}

export function faultWord(name) {
    return has(`fault.${name}`) ? t(`fault.${name}`) : name;
}

// "trigger c03" is the check "trigger" of the camera c03; "disk speed" is one of its own.
function family(name) {
    if (has(`check.${name}`))
        return { key: `check.${name}`, camera: "" };
    const space = name.indexOf(" ");
    const key = `check.${name.slice(0, space)}`;

    return space > 0 && has(key) ? { key, camera: name.slice(space + 1) } : { key: null, camera: "" };
}

export function checkTitle(name) {
    const { key, camera } = family(name);

    if (!key)
        return name;
    return camera ? `${t(key)}: ${camera}` : t(key);
}

export function checkTodo(name, verdict) {
    const { key } = family(name);

    if (verdict === "green" || verdict === "undecided" || !key)
        return "";
    return has(`${key}.todo`) ? t(`${key}.todo`) : "";
}

// An ApiError in words, with what to do. lumid's own line is shown as it is.
export function errorWords(error) {
    const key = has(`error.${error.word}`) ? `error.${error.word}` : error.status >= 500 ? "error.internal" : "";

    if (!key)
        return error.detail ? t("error.refused", { detail: error.detail }) : t("error.unknown");
    return t(key, { detail: error.detail ?? "" });
}

// A place for what came of something, beside what was pressed: say("good" | "bad" | "info", text), clear().
export function noticeBox(test = "notice") {
    const element = h("p", { class: "notice", role: "status", test, hidden: true });

    let since = 0;

    return {
        element,
        // What was said of something that has passed goes: called when the state of the rig has changed.
        age() {
            if (Date.now() - since > NOTICE_MS)
                this.clear();
        },
        say(kind, text, ...more) {
            since = Date.now();
            element.hidden = false;
            element.dataset.kind = kind;
            element.replaceChildren(kind === "bad" ? `${ICONS.red} ` : kind === "good" ? `${ICONS.green} ` : "", text,
                ...more);
        },
        error(error, ...more) {
            this.say("bad", errorWords(error), ...more);
        },
        clear() {
            element.hidden = true;
            element.replaceChildren();
        },
    };
}
