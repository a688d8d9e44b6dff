// Signing in at the gateway that a page comes from: docs/access.md, "Sign-ins of pages".

/** Shows a form of `user` and `password` if the gateway wants to know who this is. Calls `done` once it does. */
export async function offerSignIn(form, done) {
  const { login, user } = await (await ask("api/v1/access?devices=false")).json();
  if (!login || user !== null) return;
  form.hidden = false;
  form.onsubmit = async (event) => {
    event.preventDefault();
    const body = JSON.stringify(Object.fromEntries(new FormData(form)));
    const answer = await ask("api/v1/session", { method: "POST", body });
    const problem = answer.ok ? "" : (await answer.json()).detail;
    form.querySelector("[role=alert]").textContent = problem;
    if (problem) return;
    form.hidden = true;
    done();
  };
}

/** X-Requested-With: the page has a form, so the browser shall show no dialog of its own. */
function ask(path, init) {
  return fetch(path, { ...init, headers: { "Content-Type": "application/json", "X-Requested-With": "rrgate" } });
}
