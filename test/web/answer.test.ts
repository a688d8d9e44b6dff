// Mirrors web/src/gateway/answer.ts.
import { expectOk } from "../../web/src/gateway/answer";

const refused = (body: string) => expectOk(new Response(body, { status: 503 }));

describe("an answer of the gateway", () => {
  it("is handed on where it is good", async () => {
    const good = new Response("{}");
    expect(await expectOk(good)).toBe(good);
  });

  it("fails with what the gateway says, and with its status where it says nothing for people", async () => {
    await expect(refused('{"detail": "device offline"}')).rejects.toThrow(/^device offline$/);
    for (const body of ["", "<html>", "null", '{"detail": 7}'])
      await expect(refused(body), body).rejects.toThrow(/^the gateway answered 503$/);
  });
});
