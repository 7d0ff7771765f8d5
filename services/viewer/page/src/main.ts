// The page: one store, one map, panels; pictures only when something has changed.
import "uplot/dist/uPlot.min.css";
import "./style.css";
import { App } from "./app";
import { expose } from "./expose";

const app = new App(document.getElementById("app")!);
expose(app);
