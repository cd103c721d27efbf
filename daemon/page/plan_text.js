// The text of a plan (docs/rig-plan.md) as values by key and back, so that what somebody wrote by hand, comments and
// all, stays as it is when one value is set by the form.

function lineOf(text) {
    const found = /^\s*([a-z_]+)\s*=\s*(.*?)\s*$/.exec(text);

    return found ? { key: found[1], value: found[2] } : null;
}

export function planValues(text) {
    const values = {};

    for (const line of text.split(/\r?\n/)) {
        const found = lineOf(line);
        if (found && !(found.key in values))
            values[found.key] = found.value;
    }
    return values;
}

// "" takes the line out: what is left out has the default.
export function setPlanValue(text, key, value) {
    const lines = text.split(/\r?\n/);
    const at = lines.findIndex((line) => lineOf(line)?.key === key);

    if (value === "") {
        if (at >= 0)
            lines.splice(at, 1);
        return lines.join("\n");
    }
    if (at >= 0) {
        lines[at] = `${key} = ${value}`;
        return lines.join("\n");
    }
    let head = lines.findIndex((line) => line.trim() === "[sweep]");
    if (head < 0) {
        lines.unshift("[sweep]");
        head = 0;
    }
    let last = head; // behind the last line that says something
    lines.forEach((line, i) => {
        if (i > head && line.trim() !== "")
            last = i;
    });
    lines.splice(last + 1, 0, `${key} = ${value}`);
    return lines.join("\n");
}

export function planName(text) {
    return planValues(text).name ?? "";
}
