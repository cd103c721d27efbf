// Who is here: the session, logging in where one stands (the view stays as it is), pairing of phones.
import { ApiError, get, onLogin, post, setCsrf } from "./api.js";
import * as dialog from "./dialog.js";
import { fill, h } from "./dom.js";
import { duration, t } from "./i18n.js";
import { store } from "./store.js";
import * as stream from "./stream.js";
import { errorWords, noticeBox } from "./words.js";

// A lumid without users and sessions answers its own computer only: whoever sees the page is the operator.
const LOCAL = { users: false, you: { name: "this computer", role: "operate", via: "local" }, csrf: null,
    expires: null, secure: null };

let asking = null;
let fallback = false;
let fetching = null;

function keep(session) {
    const before = store.get("session");

    setCsrf(session.csrf ?? null);
    document.dispatchEvent(new CustomEvent("lumi-session", { detail: { csrf: session.csrf ?? null } }));
    if (JSON.stringify(before) !== JSON.stringify(session))
        store.set("session", session);
    return session;
}

async function fetchOnce() {
    try {
        return keep(await get("/api/v1/session", { quiet: true }));
    } catch (error) {
        if (error.word === "absent") {
            fallback = true;
            return keep(LOCAL);
        }
        throw error;
    }
}

// Once, however many ask at a time.
export function fetchSession() {
    fetching ??= fetchOnce().finally(() => {
        fetching = null;
    });
    return fetching;
}

export function sessionsOffered() {
    return !fallback;
}

const CODE = /^#(?:code|pair)=([\w-]{4,64})$/;

export function hasCode() {
    return CODE.test(location.hash);
}

// The code of a QR link is used once and taken out of the address, so that no history or bookmark keeps it.
function codeOfAddress() {
    const found = CODE.exec(location.hash);

    if (found)
        history.replaceState(null, "", location.pathname + location.search);
    return found ? found[1] : null;
}

async function logIn(body) {
    keep(await post("/api/v1/session/login", body, { quiet: true }));
    if (!store.get("session").you)
        throw new ApiError(401, "login", "");
}

// After too many wrong ones nothing is sent until lumid would look at it again, and how long that is is told.
function limited(error, button, said) {
    const until = Date.now() + error.after * 1000;
    const tick = () => {
        const left = Math.ceil((until - Date.now()) / 1000);

        button.disabled = left > 0 && button.isConnected;
        if (!button.disabled) {
            clearInterval(timer);
            if (error.after)
                said.clear();
            return;
        }
        said.say("bad", t("login.wait", { time: duration(left) }));
    };
    const timer = setInterval(tick, 1000);

    tick();
}

function form(fields, test, said, done) {
    const button = h("button", { type: "submit", class: "primary", test }, t("login.submit"));

    return h("form", { on: { submit: async (event) => {
        event.preventDefault();
        const body = {};
        for (const input of event.target.querySelectorAll("input"))
            body[input.name] = input.name === "code" ? input.value.trim() : input.value;
        button.disabled = true;
        said.say("info", t("login.asking"));
        try {
            await logIn(body);
            done();
        } catch (error) {
            said.error(error);
            const password = event.target.querySelector("[name=password], [name=code]");
            password.value = "";
            password.focus();
            limited(error, button, said);
        }
    } } }, fields, h("div", { class: "row end" }, button));
}

function field(name, test, attributes) {
    return h("label", { class: "field" }, h("span", {}, t(`login.${name}`)), h("input", { name, test, ...attributes }));
}

function dialogOf(reason) {
    const said = noticeBox();
    let box = null;
    const done = () => box.close(true);

    if (reason)
        said.say("info", reason);
    box = dialog.show(t("login.title"), [
        said.element,
        form([
            field("name", "login-name", { autocomplete: "username", required: true, autocapitalize: "none",
                spellcheck: "false", maxlength: 64 }),
            field("password", "login-password", { type: "password", autocomplete: "current-password",
                required: true, maxlength: 256 }),
        ], "login-submit", said, done),
        h("details", { open: matchMedia("(pointer: coarse)").matches },
            h("summary", {}, t("login.byCode")),
            h("p", {}, t("login.codeHelp")),
            form([field("code", "login-code", { autocomplete: "one-time-code", required: true, spellcheck: "false",
                autocapitalize: "characters", maxlength: 32 })], "login-code-submit", said, done)),
        h("p", { class: "why" }, t("login.forgot")),
    ], { test: "login", keep: true });
    return box.closed;
}

// The dialog, once however many ask. Until somebody has logged in, nothing else is to be had; the emergency stop says
// what it can.
export function openLogin(reason) {
    asking ??= dialogOf(reason).finally(() => {
        asking = null;
    });
    return asking;
}

// A request was refused: true when there is a session now.
async function refused(error) {
    const session = await fetchSession();

    if (session.you)
        return true;
    return openLogin(error.word === "csrf" || !store.get("capture") ? "" : t("login.ranOut"));
}

// Logs in by the code of the address, where it has one: false where it has none.
export async function pairByAddress() {
    const code = codeOfAddress();

    if (!code)
        return false;
    try {
        await logIn({ code });
    } catch (error) {
        await fetchSession().catch(() => {});
        if (!store.get("session")?.you)
            await openLogin(errorWords(error));
    }
    return true;
}

export async function startSession() {
    onLogin(refused);
    document.addEventListener("lumi-login", () => openLogin(t("login.ranOut")));
    if (await pairByAddress())
        return;
    // Where lumid does not answer (yet) the stream finds out when it does, and a session that is lacking is asked for.
    await fetchSession().catch(() => {});
}

export async function requireSession() {
    const session = store.get("session");

    if (session && !session.you)
        await openLogin("");
}

export async function logOut() {
    await post("/api/v1/session/logout", {}, { quiet: true });
    stream.stop();
    location.reload(); // nothing of what was seen stays
}

// The QR is lumid's own picture: as an image, never as markup of this page.
function pairing(pair, box) {
    const left = h("strong", { test: "pair-left" });
    const url = URL.createObjectURL(new Blob([pair.qr ?? ""], { type: "image/svg+xml" }));
    const tick = () => {
        const seconds = (new Date(pair.expires) - Date.now()) / 1000;

        left.textContent = seconds > 0 ? t("pair.left", { time: duration(seconds) }) : t("pair.over");
        if (!box.isConnected) {
            clearInterval(timer);
            URL.revokeObjectURL(url);
        }
    };
    const timer = setInterval(tick, 1000);

    queueMicrotask(tick);
    return [
        h("p", {}, t(`pair.how.${pair.role}`)),
        h("img", { class: "qr", src: url, alt: t("pair.qr"), test: "pair-qr" }),
        h("dl", { class: "facts wide" }, [
            ["pair.address", { test: "pair-url" }, String(pair.url ?? "").split("#")[0]],
            ["pair.code", { class: "code", test: "pair-code" }, pair.code],
            ["pair.fingerprint", { class: "code small" }, pair.fingerprint || t("unknown")],
        ].map(([key, attributes, text]) => h("div", {}, h("dt", {}, t(key)), h("dd", attributes, text)))),
        h("p", {}, left),
        h("p", { class: "why" }, t("pair.certificate")),
    ];
}

export async function openPair() {
    const said = noticeBox();
    const shown = h("div", {});
    const role = h("select", { test: "pair-role" }, h("option", { value: "operate" }, t("role.operate")),
        h("option", { value: "watch" }, t("role.watch")));
    let box = null;
    const make = async () => {
        said.clear();
        fill(shown);
        try {
            const pair = await post("/api/v1/session/pair", { role: role.value });
            fill(shown, pairing({ ...pair, role: role.value }, shown));
        } catch (error) {
            said.error(error);
        }
    };
    const closer = () => h("div", { class: "row end" },
        h("button", { type: "button", test: "dialog-close", on: { click: () => box.close() } }, t("close")));

    if (!store.get("session")?.users) {
        box = dialog.show(t("pair.title"), [h("p", {}, t("pair.noUsers")), h("pre", { class: "code" }, "sudo lumi user add NAME"),
            h("p", {}, t("pair.noUsersThen")), closer()], { test: "pair-dialog" });
        await box.closed;
        return;
    }
    box = dialog.show(t("pair.title"), [
        h("div", { class: "row" }, h("label", { class: "field" }, h("span", {}, t("pair.may")), role),
            h("button", { type: "button", class: "primary", test: "pair-make", on: { click: make } }, t("pair.make"))),
        said.element, shown, closer(),
    ], { test: "pair-dialog" });
    await box.closed;
}
