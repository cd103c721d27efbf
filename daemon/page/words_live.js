// Figures of a running capture in words for people.
import { number, t } from "./i18n.js";

// "about 4 minutes": what one wants to know of a time to come. Rounded up: better early than late.
export function aboutTime(seconds) {
    if (seconds === null || seconds === undefined || !Number.isFinite(seconds))
        return t("unknown");
    if (seconds < 1)
        return t("time.now");
    if (seconds < 55)
        return t("time.seconds", { n: seconds < 10 ? Math.ceil(seconds) : Math.ceil(seconds / 5) * 5 });
    const minutes = Math.ceil(seconds / 60 - 0.1);
    if (minutes < 90)
        return t("time.minutes", { n: minutes });
    if (minutes < 36 * 60)
        return t("time.hours", { n: Math.floor(minutes / 60), minutes: minutes % 60 });
    return t("time.days", { n: Math.round(minutes / 1440) });
}

export function percent(share, digits = 1) {
    return share === null || share === undefined || !Number.isFinite(share) ? t("unknown") : `${number(share * 100, digits)} %`;
}
