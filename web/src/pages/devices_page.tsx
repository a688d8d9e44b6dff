// The first page: which devices are behind this gateway, how they are, and what they offer.
// Layer: web/pages.

import { useNow, useStore } from "../app/store";
import { format_route } from "../app/router";
import { devices_of } from "../gateway/devices";
import type { Device, DeviceList, GatewayState, Service } from "../gateway/devices";
import { StateBadge } from "../ui/state_badge";
import { clock_time, sentence, span } from "../ui/words";

export function DevicesPage({ list }: { list: DeviceList }) {
  const state = useStore(list.state);
  const devices = devices_of(state);
  return (
    <div class="page page-narrow">
      <h1>Devices</h1>
      <GatewayLine state={state} />
      {state.kind === "loading" && <LoadingRows />}
      {devices && devices.length === 0 && state.kind === "known" && <NoDevices />}
      {devices && devices.length > 0 && (
        <ul class={`devices ${state.kind === "away" ? "is-stale" : ""}`}>
          {devices.map((device) => (
            <DeviceRow key={device.name} device={device} stale={state.kind === "away"} />
          ))}
        </ul>
      )}
    </div>
  );
}

function GatewayLine({ state }: { state: GatewayState }) {
  if (state.kind === "away") return <AwayLine state={state} />;
  if (state.kind === "loading") return <p class="gateway-line">Asking the gateway …</p>;
  const online = state.devices.filter((device) => device.state === "online").length;
  const count = state.devices.length;
  return (
    <p class="gateway-line" data-gateway="known">
      {count === 0 ? `Gateway at ${location.host}` : `${online} of ${count} online behind the gateway at ${location.host}`}
    </p>
  );
}

function AwayLine({ state }: { state: GatewayState & { kind: "away" } }) {
  const now = useNow(1000);
  return (
    <div class="gateway-line gateway-away" data-gateway="away">
      <StateBadge state="offline" text="gateway away" />
      <p>
        <span role="status">
          The gateway at {location.host} does not answer since {clock_time(state.since)}: {state.reason}.
        </span>{" "}
        <span aria-hidden="true">Away for {span(now - state.since)}, asking every 2 s.</span>
        {state.devices && state.devices.length > 0 && " Below is what it said last."}
      </p>
    </div>
  );
}

function DeviceRow({ device, stale }: { device: Device; stale: boolean }) {
  return (
    <li class="device" data-device={device.name}>
      <div class="device-head">
        <h2 class="place-name">{device.name}</h2>
        <StateBadge state={device.state} text={stale ? `was ${device.state}` : device.state} />
      </div>
      <dl class="device-facts">
        <div>
          <dt>Address</dt>
          <dd class="code">{device.url}</dd>
        </div>
        {device.node_name !== "" && (
          <div>
            <dt>Node</dt>
            <dd class="code" title={device.node_id}>
              {device.node_name}
            </dd>
          </div>
        )}
      </dl>
      {device.state !== "online" && (
        <p class="device-trouble">
          {sentence(device.last_error ?? "Not reached yet")} {!stale && "The gateway keeps trying."}
        </p>
      )}
      <ul class="services">
        {device.services.map((service) => (
          <li key={service.name}>
            <ServiceLink device={device} service={service} />
          </li>
        ))}
        {device.services.length === 0 && (
          <li class="no-services">
            {device.state === "online" ? "It offers no services." : "Its services show here once it has answered."}
          </li>
        )}
      </ul>
    </li>
  );
}

function ServiceLink({ device, service }: { device: Device; service: Service }) {
  return (
    <a class="service" href={format_route(device.name, service.name)}>
      <span class="service-name">{service.name}</span>
      <span class="code service-type">{service.type === "" ? "type not read yet" : service.type}</span>
    </a>
  );
}

function LoadingRows() {
  return (
    <ul class="devices" aria-hidden="true">
      {[0, 1].map((row) => (
        <li key={row} class="device device-loading">
          <span class="bone bone-title" />
          <span class="bone" />
          <span class="bone bone-service" />
        </li>
      ))}
    </ul>
  );
}

const EXAMPLE = `{
  "listen": ["127.0.0.1:8080"],
  "devices": [
    { "name": "create",
      "url": "rr+tcp://127.0.0.1:52222/?service=Create" }
  ]
}`;

function NoDevices() {
  return (
    <section class="empty">
      <h2 class="place-name">Uncharted waters</h2>
      <p>This gateway knows no devices yet. Name one in its configuration and it appears here by itself:</p>
      <pre class="code">{EXAMPLE}</pre>
      <p>
        Or start the simulated robot: <code>rrgate demo</code>
      </p>
    </section>
  );
}
