// Every text of the page is in texts.LANGUAGE.json; numbers, bytes and times as the language writes them.
import { kept } from "./store.js";

export const LANGUAGES = { en: "English", de: "Deutsch" };

let texts = {};
let language = "en";
const listeners = new Set();

function preferred() {
    const wanted = [kept.get("language", null), ...(navigator.languages ?? [navigator.language])];

    for (const tag of wanted) {
        const short = String(tag ?? "").slice(0, 2).toLowerCase();
        if (short in LANGUAGES)
            return short;
    }
    return "en";
}

async function load(wanted) {
    const answer = await fetch(`/page/texts.${wanted}.json`);

    if (!answer.ok)
        throw new Error(`texts.${wanted}.json: ${answer.status}`);
    texts = await answer.json();
    language = wanted;
    document.documentElement.lang = wanted;
    translate(document);
    document.dispatchEvent(new CustomEvent("lumi-texts", { detail: texts })); // for estop.js, which imports nothing
}

export function loadTexts() {
    return load(preferred());
}

export function currentLanguage() {
    return language;
}

export async function setLanguage(wanted) {
    await load(wanted);
    kept.set("language", wanted);
    for (const call of listeners)
        call();
}

export function onLanguage(call) {
    listeners.add(call);
    return () => listeners.delete(call);
}

export function has(key) {
    return key in texts;
}

// t("plan.line", {line: "3", text: "…"}). Where `n` is given and the key has forms ("key.one", "key.other"), that of n.
export function t(key, values = {}) {
    let text = texts[key];

    if (text === undefined && values.n !== undefined)
        text = texts[`${key}.${new Intl.PluralRules(language).select(values.n)}`] ?? texts[`${key}.other`];
    if (text === undefined) {
        console.error(`no text for ${key} in ${language}`);
        return key;
    }
    return text.replace(/\{(\w+)\}/g, (all, name) => {
        const value = values[name];

        return typeof value === "number" ? number(value) : value ?? all;
    });
}

// Elements of index.html name their text in data-t, that of their aria-label in data-t-label.
export function translate(root) {
    for (const element of root.querySelectorAll("[data-t]"))
        element.textContent = t(element.dataset.t);
    for (const element of root.querySelectorAll("[data-t-label]"))
        element.setAttribute("aria-label", t(element.dataset.tLabel));
}

export function number(value, digits = 0) {
    if (value === null || value === undefined || !Number.isFinite(value))
        return t("unknown");
    return new Intl.NumberFormat(language, { maximumFractionDigits: digits }).format(value);
}

export function bytes(value) {
    const units = ["B", "kB", "MB", "GB", "TB"];
    let unit = 0;

    if (value === null || value === undefined || !Number.isFinite(value))
        return t("unknown");
    while (Math.abs(value) >= 1000 && unit < units.length - 1) {
        value /= 1000;
        unit += 1;
    }
    return `${number(value, unit > 0 && Math.abs(value) < 100 ? 1 : 0)} ${units[unit]}`;
}

const DAYS_FROM = 2 * 86400;

// Seconds as 12 s, 4:05 min, 1:02:03 h, 12 days.
export function duration(seconds) {
    if (seconds === null || seconds === undefined || !Number.isFinite(seconds))
        return t("unknown");
    const all = Math.max(0, Math.round(seconds));
    const two = (value) => String(value).padStart(2, "0");

    if (all < 60)
        return `${all} s`;
    if (all < 3600)
        return `${Math.floor(all / 60)}:${two(all % 60)} min`;
    if (all >= DAYS_FROM)
        return t("days", { n: Math.floor(all / 86400) });
    return `${Math.floor(all / 3600)}:${two(Math.floor(all / 60) % 60)}:${two(all % 60)} h`;
}

export function clock(time) {
    const date = time instanceof Date ? time : new Date(time);

    return Number.isNaN(date.getTime()) ? t("unknown") : date.toLocaleTimeString(language);
}

export function dateTime(time) {
    const date = time instanceof Date ? time : new Date(time);

    return Number.isNaN(date.getTime()) ? t("unknown")
        : date.toLocaleString(language, { dateStyle: "medium", timeStyle: "short" });
}
