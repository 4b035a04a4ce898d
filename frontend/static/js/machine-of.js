// <form data-machine-of='{"characteristic": "machine"}'>: its field "machine" is always that of the chosen characteristic, as the server takes it.

for (const form of document.querySelectorAll("form[data-machine-of]")) {
  const of = JSON.parse(form.dataset.machineOf);
  const { machine, characteristic } = form.elements;
  const follow = () => {
    if (of[characteristic.value]) machine.value = of[characteristic.value];
  };
  characteristic.addEventListener("change", follow);
  machine.addEventListener("change", () => {
    if (of[characteristic.value] !== machine.value) characteristic.value = "";
  });
  window.addEventListener("pageshow", follow); // what the browser has put back
}
