// The emergency stop. It imports nothing, so that it works where everything else has failed to load; its words are
// in index.html until the translation is there ("lumi-texts"). It sends at once and asks nothing; what it cannot
// send it tries again for a minute, and says so loudly.

const PATH = "/api/v1/capture/emergency-stop";
const ANSWER_MS = 2500;
const AGAIN_MS = 500;
const TRYING_MS = 60000;
const HAMMER_MS = 1500; // Escape three times within this is the key for it

const button = document.getElementById("estop");
const box = document.getElementById("estop-box");
const said = document.getElementById("estop-said");
const close = document.getElementById("estop-close");

const channel = typeof BroadcastChannel === "function" ? new BroadcastChannel("lumid") : null;

let csrf = null;
let words = {};
let presses = 0;
let shown = null;
let escapes = [];

function text(name, values = {}) {
    const found = words[`estop.${name}`] ?? said.dataset[name] ?? name;

    return found.replace(/\{(\w+)\}/g, (all, key) => values[key] ?? all);
}

// state: sending, sent, away, failed, login, givenUp
function say(state, values) {
    shown = { state, values };
    box.hidden = false;
    box.dataset.state = state;
    said.textContent = text(state, values);
    button.dataset.state = state;
}

async function session() {
    try {
        const answer = await fetch("/api/v1/session", { cache: "no-store", signal: AbortSignal.timeout(ANSWER_MS) });
        if (answer.ok)
            csrf = (await answer.json()).csrf ?? null;
    } catch { /* the stop is tried without */ }
}

// One attempt: "sent", "away", "login", "failed", or "stale" where the page's proof of origin is an old one.
async function attempt() {
    const headers = { "Content-Type": "application/json" };

    if (csrf)
        headers["X-Lumid-Csrf"] = csrf;
    try {
        const answer = await fetch(PATH, { method: "POST", headers, body: "{}", keepalive: true, cache: "no-store",
            credentials: "same-origin", signal: AbortSignal.timeout(ANSWER_MS) });
        if (answer.ok)
            return (await answer.json()).sent ? "sent" : "away";
        if (answer.status === 401)
            return "login";
        return answer.status === 403 ? "stale" : "failed";
    } catch {
        return "failed";
    }
}

const time = () => new Date().toLocaleTimeString(document.documentElement.lang || undefined);

async function press() {
    const mine = ++presses; // a later press takes over what is shown, and what is tried
    const began = performance.now();

    // Whoever holds connections of this browser lets them go: there are six, and this wants one of them.
    document.dispatchEvent(new Event("lumi-estop"));
    channel?.postMessage("estop"); // its other pages too
    say("sending");
    for (let tries = 1; mine === presses; tries++) {
        let outcome = await attempt();
        if (outcome === "stale") {
            await session();
            outcome = await attempt();
        }
        if (outcome === "sent" || outcome === "away" || outcome === "login") {
            if (mine === presses || outcome === "sent")
                say(outcome, { time: time() });
            if (outcome === "login")
                document.dispatchEvent(new Event("lumi-login"));
            return;
        }
        if (mine !== presses)
            return;
        if (performance.now() - began > TRYING_MS) {
            say("givenUp");
            return;
        }
        say("failed", { tries });
        await new Promise((resolve) => setTimeout(resolve, AGAIN_MS));
    }
}

button.addEventListener("click", press);
button.dataset.ready = "yes";
close.addEventListener("click", () => {
    presses++; // ends what is still being tried
    box.hidden = true;
    delete button.dataset.state;
    button.focus();
});
addEventListener("keydown", (event) => {
    if (event.key !== "Escape" || event.repeat)
        return;
    escapes = escapes.filter((at) => event.timeStamp - at < HAMMER_MS);
    escapes.push(event.timeStamp);
    if (escapes.length >= 3) {
        escapes = [];
        press();
    }
}, true);

channel?.addEventListener("message", ({ data }) => {
    if (data === "estop")
        document.dispatchEvent(new Event("lumi-estop"));
});
document.addEventListener("lumi-session", ({ detail }) => {
    csrf = detail.csrf ?? null;
});
document.addEventListener("lumi-texts", ({ detail }) => {
    words = detail;
    if (shown && !box.hidden)
        say(shown.state, shown.values);
});
session();
