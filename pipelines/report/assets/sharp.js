"use strict";
// uPlot draws as many pixels as the screen has, once: a page that is printed needs twice those of a coarse screen.
if (devicePixelRatio < 2) Object.defineProperty(window, "devicePixelRatio", { value: 2, configurable: true });
