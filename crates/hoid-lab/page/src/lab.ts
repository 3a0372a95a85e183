// The page that hoid lab serves.

import { begin } from "./main";
import { Server } from "./server";

begin((listener, opened) => new Server(listener, opened));
