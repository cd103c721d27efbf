// What the page weighs on the wire, and when something is to be seen, on a slow telephone: 1.6 Mbit/s, answers after 150 ms,
// a processor four times slower (Lighthouse's "slow 4G").
import { check } from "./bench.mjs";

export const rig = { arc: "4x6:0.2" };
const RUNS = 3;

async function first(bench) {
    const page = await bench.open({ size: "phone", path: "about:blank" });
    const wire = await page.context().newCDPSession(page);
    const seen = new Map();

    await wire.send("Network.enable");
    await wire.send("Network.emulateNetworkConditions", { offline: false, latency: 150,
        downloadThroughput: 1.6e6 / 8, uploadThroughput: 0.75e6 / 8 });
    await wire.send("Emulation.setCPUThrottlingRate", { rate: 4 });
    wire.on("Network.requestWillBeSent", (one) => seen.set(one.requestId, { url: one.request.url, bytes: 0 }));
    wire.on("Network.loadingFinished", (one) => {
        if (seen.has(one.requestId))
            seen.get(one.requestId).bytes = one.encodedDataLength;
    });
    await page.goto("/");
    await page.at("preflight-run").waitFor();
    const usable = await page.evaluate(() => performance.now());
    const paint = await page.evaluate(() => performance.getEntriesByName("first-contentful-paint")[0].startTime);
    const blocking = await page.evaluate(() => performance.getEntriesByType("resource")
        .filter((one) => one.renderBlockingStatus === "blocking").map((one) => one.name));
    await page.waitForTimeout(1000);
    const files = [...seen.values()].filter((one) => !one.url.includes("/api/"));
    const bytes = files.reduce((sum, one) => sum + one.bytes, 0);

    await bench.picture(page, "slow-phone");
    check(bytes < 300000, `${bytes} bytes before the page is there`);
    // Nothing but the document and its two styles is waited for before something is painted.
    check(blocking.length <= 2 && blocking.every((name) => name.endsWith(".css")), `waited for before the first paint: ${blocking}`);
    await bench.closePage(page);
    return { paint, usable, files: files.length, bytes };
}

async function slow(bench) {
    const runs = [];

    await bench.closePage(await bench.open()); // the browser itself is there
    for (let i = 0; i < RUNS; i++)
        runs.push(await first(bench));
    const list = (name) => runs.map((one) => one[name].toFixed(0)).join(", ");
    bench.figure("first paint on the slow profile, ms", list("paint"));
    bench.figure("everything in place there, ms", list("usable"));
    bench.figure("first view: files, bytes on the wire", `${runs[0].files}, ${runs[0].bytes}`);
}

export const cases = [["the first view on a slow telephone", slow]];
