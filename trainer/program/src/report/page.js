// Enlarges a row of pictures on a click.
const dialog = document.createElement("dialog");
dialog.addEventListener("click", () => dialog.close());
document.body.append(dialog);
for (const link of document.querySelectorAll(".gallery .row a")) {
  link.addEventListener("click", (event) => {
    if (event.ctrlKey || event.metaKey || event.shiftKey) return;
    event.preventDefault();
    const row = link.closest(".row");
    const title = row.previousElementSibling.cloneNode(true);
    const copy = row.cloneNode(true);
    for (const anchor of copy.querySelectorAll("a")) anchor.removeAttribute("href");
    dialog.replaceChildren(title, copy);
    dialog.showModal();
  });
}
