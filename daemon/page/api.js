// Requests to lumid. What fails becomes an ApiError that says what kind it is: `word` is the last of the problem's type
// (docs/api.md), or "network", "timeout" (no answer), "absent" (this lumid has no such path), "stopped" (given up for
// the sake of an emergency stop).
//
// A browser keeps six connections to a server, the stream of events has one of them. Whoever holds others open for long
// (moving pictures) takes at most LIVE_MOST, and lets them go on the document's event "lumi-estop".

export const LIVE_MOST = 3;
const PATIENCE_MS = 15000;

export class ApiError extends Error {
    constructor(status, word, detail) {
        super(detail);
        this.name = "ApiError";
        this.status = status;
        this.word = word;
        this.detail = detail;
    }
}

let csrf = null;
let login = null;
const pending = new Set();

export function setCsrf(token) {
    csrf = token;
}

// `call` asks for name and password; its promise is kept when somebody has logged in, false: they would not.
export function onLogin(call) {
    login = call;
}

document.addEventListener("lumi-estop", () => {
    for (const abort of pending)
        abort.abort("stopped");
});

// What an answer that is none says, as an ApiError.
export async function problem(answer) {
    let found = {};

    try {
        found = await answer.json();
    } catch { /* no problem document: the status says it */ }
    const word = String(found.type ?? "").split(":").pop() || `status${answer.status}`;

    const error = new ApiError(answer.status, answer.status === 404 && word === "path" ? "absent" : word,
        found.detail ?? `${answer.status} ${answer.statusText}`);
    error.after = Number(answer.headers.get("Retry-After")) || 0; // seconds
    return error;
}

async function once(method, path, body, options) {
    const abort = new AbortController();
    const timer = setTimeout(() => abort.abort("timeout"), options.patience ?? PATIENCE_MS);
    const headers = { Accept: "application/json" };

    if (method === "POST") {
        headers["Content-Type"] = "application/json";
        if (csrf)
            headers["X-Lumid-Csrf"] = csrf;
    }
    pending.add(abort);
    try {
        const answer = await fetch(path, { method, headers, signal: abort.signal, cache: "no-store",
            credentials: "same-origin", body: method === "POST" ? JSON.stringify(body ?? {}) : undefined });

        if (!answer.ok)
            throw await problem(answer);
        return options.raw ? answer : await answer.json();
    } catch (error) {
        if (error instanceof ApiError)
            throw error;
        const why = abort.signal.aborted ? String(abort.signal.reason) : "network";
        throw new ApiError(0, why, String(error));
    } finally {
        clearTimeout(timer);
        pending.delete(abort);
    }
}

async function request(method, path, body, options = {}) {
    try {
        return await once(method, path, body, options);
    } catch (error) {
        const out = error.status === 401 && error.word !== "login";

        if (!(out || error.word === "csrf") || !login || options.quiet)
            throw error;
        if (!await login(error))
            throw error;
        // What moves the rig is not sent again by itself: who asked may have walked up to it meanwhile.
        if (out && options.moves)
            throw new ApiError(401, "again", error.detail);
        return once(method, path, body, options);
    }
}

// options: patience (ms), quiet (a session that ran out is an error like others: nobody is asked to log in),
// raw (the Response), moves (see above)
export function get(path, options) {
    return request("GET", path, undefined, options);
}

export function post(path, body, options) {
    return request("POST", path, body, options);
}
