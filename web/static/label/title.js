// "(3) …" in the tab's title while pairs wait and somebody looks elsewhere.

const plain = document.title;

export function badge(waiting) {
  const away = document.hidden || !document.hasFocus();
  document.title = away && waiting > 0 ? `(${waiting}) ${plain}` : plain;
}
