// Applies the chosen theme before the first paint. A classic script of its own, because inline scripts are not allowed.
try {
  const theme = localStorage.getItem("rrgate-theme");
  if (theme === "light" || theme === "dark") document.documentElement.dataset.theme = theme;
} catch {
  // Storage may be forbidden: the system's theme it is.
}
