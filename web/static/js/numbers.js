// Numbers as the server writes them: thousands apart by a thin space, a true minus.
const apart = (text) => text.replace(/\B(?=(\d{3})+(?!\d))/g, "\u202f").replace("-", "−");

export const number = (value) => apart(String(Math.round(value)));

export const decimal = (value, places = 1) => {
  if (value === null || value === undefined) return "–";
  const [whole, fraction] = value.toFixed(places).split(".");
  return fraction ? `${apart(whole)}.${fraction}` : apart(whole);
};

/** What an evaluation measured: a count whole, another number with a decimal, anything else as it is. */
export const measure = (value) =>
  typeof value === "number" ? decimal(value, Number.isInteger(value) ? 0 : 1) : String(value);
