// Lets the page be installed, and says plainly that it is offline when it is. Nothing else is kept: a page of yesterday,
// or a device's old values, would be worse than none.
const CACHE = "rrgate-offline-1";

self.addEventListener("install", (event) => {
  event.waitUntil(caches.open(CACHE).then((cache) => cache.addAll(["offline.html", "offline.css", "icon.svg"])));
  self.skipWaiting();
});

self.addEventListener("activate", (event) => {
  const remove = async () => {
    const names = await caches.keys();
    await Promise.all(
      names.filter((name) => name.startsWith("rrgate-") && name !== CACHE).map((name) => caches.delete(name)),
    );
    await self.clients.claim();
  };
  event.waitUntil(remove());
});

self.addEventListener("fetch", (event) => {
  const path = new URL(event.request.url).pathname;
  if (event.request.mode === "navigate")
    event.respondWith(fetch(event.request).catch(async () => (await caches.match("offline.html")) ?? Response.error()));
  else if (/\/(offline\.css|icon\.svg)$/.test(path))
    event.respondWith(fetch(event.request).catch(async () => (await caches.match(event.request)) ?? Response.error()));
});

self.addEventListener("notificationclick", (event) => {
  const show = async () => {
    const [page] = await self.clients.matchAll({ type: "window" });
    await (page ? page.focus() : self.clients.openWindow("./"));
  };
  event.notification.close();
  event.waitUntil(show());
});
