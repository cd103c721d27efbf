// Scripts of the operator's page that need no browser: the text of a plan and its values, events out of a stream.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";

// By their text: Node.js 18 takes a .js file for a module only where a package.json says so, and the page has none.
async function script(name) {
    const text = await readFile(new URL(`../../daemon/page/${name}`, import.meta.url), "utf8");

    return import(`data:text/javascript,${encodeURIComponent(text)}`);
}

const { eventParser } = await script("event_parser.js");
const { planName, planValues, setPlanValue } = await script("plan_text.js");

const PLAN = "# the hall\n[sweep]\nname = hall\nturns = 3 \n\n; slowly\nturn_time_s=60\n";

function parsed(pieces) {
    const told = [];
    const feed = eventParser((kind, data, id) => told.push([kind, data, id]));

    pieces.forEach(feed);
    return told;
}

const cases = {
    "values are read whatever the spaces, comments are none"() {
        assert.deepEqual(planValues(PLAN), { name: "hall", turns: "3", turn_time_s: "60" });
        assert.equal(planName(PLAN), "hall");
        assert.deepEqual(planValues("# turns = 3\n;mode = video\n"), {});
    },
    "a value is set where it stands, and all else stays as it was"() {
        assert.equal(setPlanValue(PLAN, "turns", "4"), PLAN.replace("turns = 3 ", "turns = 4"));
    },
    "a value that is not there comes behind the last line that says something"() {
        assert.equal(setPlanValue(PLAN, "mode", "video"), PLAN.replace("60\n", "60\nmode = video\n"));
        assert.equal(setPlanValue("", "turns", "2").trim(), "[sweep]\nturns = 2");
    },
    "an empty value takes its line out, and only that"() {
        assert.equal(setPlanValue(PLAN, "turns", ""), PLAN.replace("turns = 3 \n", ""));
        assert.equal(setPlanValue(PLAN, "mode", ""), PLAN);
    },
    "an event is told once, however the stream was cut"() {
        const text = "id: 5-7\nevent: shot\ndata: {\"shot\":3}\n\n: still here\n\nevent: progress\ndata: {}\n\n";
        const whole = [["shot", "{\"shot\":3}", "5-7"], ["progress", "{}", undefined]];

        assert.deepEqual(parsed([text]), whole);
        assert.deepEqual(parsed([...text]), whole);
        assert.deepEqual(parsed([...text.replaceAll("\n", "\r\n")]), whole);
        for (let at = 1; at < text.length; at++)
            assert.deepEqual(parsed([text.slice(0, at), text.slice(at)]), whole);
    },
    "lines of data are joined, an event without any is none, one that did not end is not told"() {
        assert.deepEqual(parsed(["data: a\ndata:b\ndata\n\nevent: x\n\ndata: half"]), [["message", "a\nb\n", undefined]]);
    },
};

for (const [name, run] of Object.entries(cases)) {
    run();
    console.log(`ok: ${name}`);
}
