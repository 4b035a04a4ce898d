// <form data-looks-again> – a GET form that is sent as soon as something in it is changed; its button is for those without script.

for (const form of document.querySelectorAll("form[data-looks-again]")) {
  form.classList.add("scripted");
  form.addEventListener("change", () => form.requestSubmit());
}
