// The order of the pages. Paths are those of the staged pages (scripts/stage.mjs), without their ending.
const group = (text, items, collapsed) => ({ text, collapsed, items: items.map(([text, link]) => ({ text, link })) });

/** @param {[string, string][]} decisions title and path of each */
export const makeSidebar = (decisions) => [
  group("Start", [
    ["What rrgate is", "/"],
    ["Five minutes", "/start"],
    ["Systems to try", "/systems"],
  ]),
  group("Tutorials", [
    ["A first device in C++", "/tutorials/cpp-device"],
    ["A first device in Python", "/tutorials/python-device"],
    ["A first page", "/tutorials/page"],
    ["A robot", "/tutorials/robot"],
    ["A robot of the standard types", "/tutorials/standard-robot"],
    ["A robot, a camera and an agent", "/tutorials/agent"],
  ]),
  group("For authors of pages", [
    ["rrgate-client", "/rrgate-client"],
    ["HTTP and JSON", "/http-api"],
  ]),
  group("For authors of devices", [
    ["Devices in C++", "/device-author"],
    ["Service definitions", "/definition-tools"],
    ["Libraries in a program", "/embedding"],
    ["Subscriptions in C++", "/subscriptions"],
  ]),
  group("For operators", [
    ["Operating a gateway", "/deploy"],
    ["The dashboard", "/dashboard"],
    ["Devices from the command line", "/command-line"],
    ["Record and replay", "/recording"],
    ["Shared devices", "/shared-sessions"],
    ["Leases", "/leases"],
    ["Devices for agents", "/mcp"],
    ["Discovery", "/discovery"],
    ["A page as a device", "/serve"],
  ]),
  group("Security", [
    ["Access control", "/access"],
    ["The audit log", "/audit"],
    ["TLS", "/tls"],
    ["Threats and defences", "/security"],
    ["Reporting a vulnerability", "/reporting"],
  ]),
  group("Behind a proxy", [["Behind a reverse proxy", "/reverse-proxy"]]),
  group("Many gateways", [["Many gateways", "/many-gateways"]]),
  group("Reference", [
    ["Configuration", "/reference/configuration"],
    ["Commands", "/reference/commands"],
    ["HTTP of the gateway", "/reference/http"],
    ["rrgate-client in TypeScript", "/reference/rrgate-client/"],
    ["The C++ API", "/reference/cpp/"],
    ["Definitions of this project", "/definitions"],
    ["Changelog", "/changelog"],
  ]),
  group("Help", [
    ["Troubleshooting", "/troubleshooting"],
    ["Comparison", "/comparison"],
    ["Benchmarks", "/benchmarks"],
  ]),
  group(
    "Inside",
    [
      ["Architecture", "/architecture"],
      ["Interoperability tests", "/interoperability"],
      ["Contributing", "/contributing"],
      ["Add a transport", "/howto/add-transport"],
      ["Add a member type", "/howto/add-member"],
      ["Add an HTTP endpoint", "/howto/add-endpoint"],
    ],
    true,
  ),
  group("Decisions", decisions, true),
];
