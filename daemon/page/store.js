// What the page knows, by name; who wants to know of a change says so.
//
//   session      as GET /api/v1/session, or null before it is known
//   connection   {state: "connecting" | "open" | "lost", since: Date}
//   status       as GET /api/v1/status; capture, checks, rig, cameras, disk, estop are its parts, kept up by events
//   people       as GET /api/v1/session/people
//   events       the last EVENTS_KEPT of [{id, kind, data}], the oldest first
//   plan         {name, text}: what is chosen for the preflight; checked: the text of the last preflight of this page

export const EVENTS_KEPT = 300;

const values = new Map(Object.entries({
    session: null,
    connection: { state: "connecting", since: null },
    status: null,
    capture: null,
    checks: [],
    rig: null,
    cameras: [],
    disk: null,
    estop: false,
    people: [],
    events: [],
    plan: null,
    checked: null,
}));
const listeners = new Map();

export const store = {
    get(name) {
        return values.get(name);
    },
    set(name, value) {
        values.set(name, value);
        for (const call of [...(listeners.get(name) ?? [])])
            call(value);
    },
    // Returns what ends it. `names`: one, or several.
    on(names, call) {
        const list = [names].flat();

        for (const name of list) {
            if (!listeners.has(name))
                listeners.set(name, new Set());
            listeners.get(name).add(call);
        }
        return () => list.forEach((name) => listeners.get(name).delete(call));
    },
};

export function mayOperate() {
    return store.get("session")?.you?.role === "operate";
}

// Settings of this browser. A browser that keeps nothing (private windows) has the defaults every time.
export const kept = {
    get(name, otherwise) {
        try {
            return JSON.parse(localStorage.getItem(`lumid.${name}`)) ?? otherwise;
        } catch {
            return otherwise;
        }
    },
    set(name, value) {
        try {
            localStorage.setItem(`lumid.${name}`, JSON.stringify(value));
            return true;
        } catch {
            return false;
        }
    },
};
