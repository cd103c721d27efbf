// What the cases share: lumid and its rig, browsers and their pages, and what no page may ever do.
//
// 1. A page asks nobody but lumid, breaks no Content Security Policy, and leaves no error on the console; what a case
//    means to bring about it allows by name (page.allow).
// 2. Pictures and figures are kept in the folder of the test.
import { spawn, spawnSync } from "node:child_process";
import { appendFileSync, existsSync, readFileSync, renameSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { connect, createServer } from "node:net";
import { join } from "node:path";

export const PORT = 8470;
const SIZES = {
    desktop: { viewport: { width: 1440, height: 900 } },
    phone: { viewport: { width: 390, height: 844 }, deviceScaleFactor: 2, hasTouch: true, isMobile: true },
    tablet: { viewport: { width: 820, height: 1180 }, hasTouch: true, isMobile: true },
};

export const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

export function check(good, text) {
    if (!good)
        throw new Error(text);
}

// Until `look` gives something true; what it throws meanwhile is kept for the error.
export async function until(what, look, seconds = 30) {
    const end = Date.now() + seconds * 1000;
    let last = "";

    for (;;) {
        try {
            const found = await look();
            if (found)
                return found;
        } catch (error) {
            last = `: ${error.message}`;
        }
        if (Date.now() > end)
            throw new Error(`not within ${seconds} s: ${what}${last}`);
        await sleep(50);
    }
}

// A wire between browser and lumid that can be cut: connections that are there are torn, new ones refused.
export class Wire {
    constructor(port) {
        this.port = port;
        this.ends = new Set();
    }

    async restore() {
        this.server = createServer((near) => {
            const far = connect(PORT, "127.0.0.1");
            for (const [one, other] of [[near, far], [far, near]]) {
                this.ends.add(one);
                one.on("error", () => other.destroy());
                one.on("close", () => {
                    this.ends.delete(one);
                    other.destroy();
                });
                one.pipe(other);
            }
        });
        await new Promise((resolve) => this.server.listen(this.port, "127.0.0.1", resolve));
    }

    cut() {
        this.server.close();
        for (const end of this.ends)
            end.destroy();
    }
}

export class Bench {
    constructor(places) {
        Object.assign(this, places);
        const require = createRequire(join(this.packages, "package.json"));
        this.chromium = require("playwright-core").chromium;
        this.axe = require.resolve("axe-core/axe.min.js");
        this.browsers = new Map();
        this.pages = [];
        this.pictures = 0;
    }

    // ---- lumid ----

    // `settings`: {group: {key: value}} beside what the rig's own configuration has.
    async start(settings) {
        const file = join(this.folder, "lumid.conf");
        let text = readFileSync(file, "utf8");

        this.access = join(this.folder, "access");
        // The pictures are small: what is smeared is no matter here.
        for (const [group, keys] of Object.entries({ judge: { blur_pixels: 12 }, ...settings })) {
            const lines = Object.entries(keys).map(([key, value]) => `${key} = ${value}\n`).join("");
            text = text.includes(`[${group}]\n`) ? text.replace(`[${group}]\n`, `[${group}]\n${lines}`)
                : `${text}\n[${group}]\n${lines}`;
        }
        writeFileSync(file, text);
        await this.startDaemon();
    }

    async startDaemon() {
        this.daemon = spawn(this.lumid, ["--config", join(this.folder, "lumid.conf")], { stdio: ["ignore", "ignore", "pipe"] });
        this.daemon.stderr.on("data", (bytes) => appendFileSync(join(this.out, "lumid.log"), bytes));
        const before = this.log().length;
        await until("lumid is ready and has its board", () => {
            check(this.daemon.exitCode === null, `lumid has ended: ${this.log()}`);
            return /ready, port[^]*the board is there/.test(this.log().slice(before));
        });
    }

    async stopDaemon(signal = "SIGTERM") {
        if (!this.daemon || this.daemon.exitCode !== null)
            return;
        const gone = new Promise((resolve) => this.daemon.once("exit", resolve));
        this.daemon.kill(signal);
        await gone;
    }

    log() {
        try {
            return readFileSync(join(this.out, "lumid.log"), "utf8");
        } catch {
            return "";
        }
    }

    plan() {
        return readFileSync(join(this.folder, "plan.txt"), "utf8");
    }

    lumiRun(...words) {
        const options = { encoding: "utf8", env: { ...process.env, LUMID_ADDRESS: `http://localhost:${PORT}` } };
        const done = spawnSync(this.lumi, words, options);
        return { status: done.status, text: `${done.stdout}${done.stderr}` };
    }

    // As `lumi capture` asks, beside any browser.
    async ask(path, body) {
        const token = join(this.access, "local.token");
        const headers = existsSync(token) ? { Authorization: `Bearer ${readFileSync(token, "utf8").trim()}` } : {};
        const options = body === undefined ? { headers } : { method: "POST", body: JSON.stringify(body),
            headers: { ...headers, "Content-Type": "application/json" } };
        const answer = await fetch(`http://localhost:${PORT}${path}`, options);
        return { status: answer.status, json: await answer.json() };
    }

    async state() {
        return (await this.ask("/api/v1/capture")).json.state;
    }

    untilState(state, seconds = 60) {
        return until(`the engine is ${state}`, async () => await this.state() === state, seconds);
    }

    // When the motor's last step was, by the clock in ms, of those times that it came to rest after `since`.
    lastStep(since) {
        const lines = readFileSync(join(this.folder, "steps.txt"), "utf8").trim().split("\n");
        const times = lines.map((line) => Number(line.split(" ")[0]) * 1000);
        return times.find((time) => time >= since);
    }

    // What goes wrong from now on (docs/rig-simulation.md).
    async fault(...lines) {
        const file = join(this.folder, "faults.now");

        writeFileSync(`${file}.new`, `${lines.map((line) => `at 0s ${line}`).join("\n")}\n`);
        renameSync(`${file}.new`, file);
        await until("the rig has taken the fault", () => !existsSync(file));
    }

    // ---- browsers ----

    async browser(flags) {
        const key = flags.join(" ");
        if (!this.browsers.has(key))
            this.browsers.set(key, await this.chromium.launch({ executablePath: "/usr/bin/chromium",
                args: ["--no-sandbox", "--disable-background-networking", ...flags] }));
        return this.browsers.get(key);
    }

    // A browser of its own (cookies, storage) with one page. size: desktop, phone, tablet; theme: dark, light.
    async open({ size = "desktop", theme = "dark", language = "en", port = PORT, origin, webgl = true, path = "/",
        allow = [], context: more = {} } = {}) {
        const flags = webgl ? ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"] : ["--disable-3d-apis"];
        const browser = await this.browser(flags);
        const context = await browser.newContext({ ...SIZES[size], colorScheme: theme, locale: language,
            baseURL: origin ?? `http://localhost:${port}`, acceptDownloads: true, ...more });
        return this.tab(context, path, allow, origin);
    }

    async tab(context, path, allow, origin) {
        const page = await context.newPage();
        page.setDefaultTimeout(15000);
        this.guard(page, [...allow], origin ? new URL(origin).hostname : "localhost");
        this.pages.push(page);
        await page.goto(path);
        return page;
    }

    guard(page, allowed, host) {
        const wrong = [];

        page.wrong = wrong;
        page.allow = (pattern) => allowed.push(pattern);
        page.at = (test, more = "") => page.locator(`[data-test="${test}"]${more}`);
        page.on("request", (request) => {
            const url = new URL(request.url());
            if (url.protocol.startsWith("http") && url.hostname !== host)
                wrong.push(`a request to ${request.url()}`);
        });
        page.on("console", (message) => {
            if (message.type() === "error" && !allowed.some((pattern) => pattern.test(message.text())))
                wrong.push(`console: ${message.text()} ${message.location().url}`);
        });
        page.on("pageerror", (error) => wrong.push(`error: ${error.stack}`));
        page.on("crash", () => wrong.push("the page crashed"));
    }

    async closePage(page) {
        this.judge(page);
        this.pages = this.pages.filter((one) => one !== page);
        await page.context().close();
    }

    judge(page) {
        check(page.wrong.length === 0, `${page.url()}:\n${page.wrong.join("\n")}`);
    }

    // After each case: nothing went wrong in any page, and each is closed.
    async endCase() {
        for (const page of [...this.pages])
            await this.closePage(page);
    }

    // ---- what is left ----

    async picture(page, name) {
        this.pictures += 1;
        const file = `${String(this.pictures).padStart(2, "0")}-${name.replaceAll(/[^\w-]+/g, "-")}.png`;
        await page.screenshot({ path: join(this.out, file), animations: "disabled" });
    }

    async pictureAll(name) {
        for (const page of this.pages)
            await this.picture(page, name).catch((error) => console.log(`no picture: ${error.message}`));
    }

    figure(name, value) {
        const line = `${name}: ${value}`;
        console.log(`          ${line}`);
        appendFileSync(join(this.out, "figures.txt"), `${line}\n`);
    }

    async stop() {
        for (const browser of this.browsers.values())
            await browser.close().catch(() => {});
        await this.stopDaemon();
    }
}
