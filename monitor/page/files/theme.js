// Before anything is drawn: the chosen colours, so that the page does not flash.
try {
  const chosen = localStorage.getItem('tribowatch-theme');
  if (chosen) document.documentElement.dataset.theme = chosen;
} catch (_) { /* storage may be switched off: the system's colours it is */ }
