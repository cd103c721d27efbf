// The page comes up, in the browser of a desk and of a pocket, and the emergency stop is in reach.
import { check } from "./bench.mjs";

export const rig = { arc: "2x4:0.2" };

export const cases = [
    ["the page is there, on a desk and on a phone", async (bench) => {
        for (const size of ["desktop", "phone"]) {
            const page = await bench.open({ size, allow: [/404/] });
            check(await page.title(), "no title");
            await bench.picture(page, size);
        }
    }],
];
