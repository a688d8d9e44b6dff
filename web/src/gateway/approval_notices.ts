// What agents wait for, as notifications of the browser, for a person who looks elsewhere.
// Layer: web/gateway.

import { Store } from "../app/store";
import { t } from "../app/language";
import type { Approval } from "./agents";

export class ApprovalNotices {
  /** "denied" also where the browser has no notifications, or none without HTTPS. */
  readonly permission = new Store<NotificationPermission>(
    typeof Notification === "undefined" ? "denied" : Notification.permission,
  );
  readonly #shown = new Map<string, () => void>();

  /** Asks the person, who must have asked for it: browsers forget nobody who says no. */
  async ask(): Promise<void> {
    this.permission.value = await Notification.requestPermission();
  }

  /** Shows what is new where the page is not looked at, and takes away what waits no more, or is looked at now. */
  show(waiting: readonly Approval[]): void {
    const wanted = this.permission.value === "granted" && document.hidden ? waiting : [];
    const ids = new Set(wanted.map(({ id }) => id));
    for (const [id, close] of this.#shown) {
      if (ids.has(id)) continue;
      close();
      this.#shown.delete(id);
    }
    for (const each of wanted) if (!this.#shown.has(each.id)) this.#shown.set(each.id, raise(each));
  }
}

/** By the service worker where there is one: phones know no other way. @returns what takes the notification away. */
function raise({ id, user, client, device, path, member }: Approval): () => void {
  const title = t("The agent of {0} asks to do this:", user === "" ? client : user);
  // What it says of its reasons stands in the page alone: whoever reads that sees who says it.
  const options = { body: `${device} · ${path}.${member}`, tag: `rrgate-${id}`, icon: "icon.svg" };
  const worker = navigator.serviceWorker?.getRegistration() ?? Promise.resolve(undefined);
  const shown = worker.then(async (registration) => {
    if (!registration) {
      const plain = new Notification(title, options);
      plain.onclick = () => window.focus();
      return [plain];
    }
    await registration.showNotification(title, options);
    return registration.getNotifications({ tag: options.tag });
  });
  shown.catch(() => undefined); // the page shows it all the same
  return () =>
    void shown.then(
      (notices) => notices.forEach((each) => each.close()),
      () => undefined,
    );
}
