// Server-sent events out of the text of a stream, however it was cut into pieces (HTML Living Standard, 9.2.6): tell(kind,
// data, id), the id undefined where this event has none.
export function eventParser(tell) {
    let rest = "", kind = "", data = [], id;

    const line = (text) => {
        if (text === "") {
            if (data.length)
                tell(kind || "message", data.join("\n"), id);
            kind = "";
            data = [];
            id = undefined;
            return;
        }
        const colon = text.indexOf(":");
        const name = colon < 0 ? text : text.slice(0, colon);
        const value = colon < 0 ? "" : text.slice(colon + 1).replace(/^ /, "");

        if (name === "event")
            kind = value;
        else if (name === "data")
            data.push(value);
        else if (name === "id" && !value.includes("\0"))
            id = value;
    };
    return (text) => {
        rest += text;
        // A carriage return at the end may be the first half of a line's end.
        const lines = rest.split(/\r\n|\n|\r(?!$)/);
        rest = lines.pop();
        for (const one of lines)
            line(one);
    };
}
