// One device of the first page: its name, its state, what is known of it, and the way to its services.
// Layer: web/pages.

import { t } from "../app/language";
import { formatRoute } from "../app/router";
import type { Device, DeviceMode, Service } from "../gateway/devices";
import { isUsb } from "../gateway/usb_devices";
import { ClassIcon } from "../ui/class_icon";
import { RecordingMark } from "../ui/recording_mark";
import { StateBadge } from "../ui/state_badge";
import { sentence } from "../ui/words";
import { SubscriptionsPart } from "./subscriptions_part";

/** What stands within an item of a list. */
export function DeviceCard({ device, stale }: { device: Device; stale: boolean }) {
  return (
    <>
      <div class="device-head">
        <ClassIcon types={device.services.map(({ type }) => type)} />
        <h2 class="place-name">{device.name}</h2>
        {device.found && (
          <span class="found-mark" title={t("Found on the network; it goes when it is not announced any more")}>
            {t("found")}
          </span>
        )}
        {isUsb(device.name) && (
          <span class="found-mark" title={t("Plugged into this computer; the page speaks to it without the gateway")}>
            USB
          </span>
        )}
        <RecordingMark device={device.name} />
        <StateBadge state={device.state} text={stale ? t("was {0}", t(device.state)) : t(device.state)} />
      </div>
      {device.state !== "online" && (
        <p class="device-trouble">
          {sentence(device.lastError ?? t("Not reached yet"))}{" "}
          {!stale && !isUsb(device.name) && t("The gateway keeps trying.")}
        </p>
      )}
      <dl class="device-facts">
        <div>
          <dt>{t("Address")}</dt>
          <dd class="code">{device.url}</dd>
        </div>
        {device.nodeName !== "" && (
          <div>
            <dt>{t("Node")}</dt>
            <dd class="code" title={device.nodeId}>
              {device.nodeName}
            </dd>
          </div>
        )}
        {device.mode !== null && (
          <div>
            <dt>{t("Mode")}</dt>
            <dd title={t(MODE[device.mode])}>{device.mode}</dd>
          </div>
        )}
        {device.clients !== null && (
          <div>
            <dt>{t("Clients")}</dt>
            <dd>{device.clients}</dd>
          </div>
        )}
      </dl>
      <ul class="services">
        {device.services.map((service) => (
          <li key={service.name}>
            <ServiceLink device={device} service={service} />
          </li>
        ))}
        {device.services.length === 0 && (
          <li class="no-services">
            {device.state === "online"
              ? t("It offers no services.")
              : t("Its services show here once it has answered.")}
          </li>
        )}
      </ul>
      {device.mode === "shared" && (
        <SubscriptionsPart device={device.name} online={device.state === "online"} stale={stale} />
      )}
    </>
  );
}

const MODE: Readonly<Record<DeviceMode, string>> = {
  relay: "Each client has a connection of its own to the device",
  shared: "All clients share one session of the gateway with the device",
};

export function ServiceLink({ device, service }: { device: Device; service: Service }) {
  return (
    <a class="service" href={formatRoute(device.name, service.name)}>
      <span class="service-name">{service.name}</span>
      <span class="code service-type">
        {service.type === ""
          ? t("type not read yet")
          : service.type.split(/(?<=\.)/).map((part) => (
              <>
                <wbr />
                {part}
              </>
            ))}
      </span>
    </a>
  );
}
