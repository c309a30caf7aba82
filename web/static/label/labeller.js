// Who labels: a name given here makes two people on two machines two labellers.

/**
 * @param {HTMLFormElement} form
 * @param {{rename: (name: string) => Promise<void>, say: (text: string) => void}} act
 */
export function labellerForm(form, act) {
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    try {
      await act.rename(new FormData(form).get("name").trim());
    } catch (error) {
      act.say(error.message);
    }
  });
}
