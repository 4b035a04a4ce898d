"""The browser kit: templates, assets, language, chart theme, security headers and problem pages. No business words."""
