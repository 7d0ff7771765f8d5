// The WebSocket to the viewer. A frame is acknowledged after it was drawn, which is what keeps a slow browser from being
// flooded; a lost connection is tried again with growing pauses, and the page says so meanwhile.
import { decode, type Message } from "./protocol";

export type LinkState = "connecting" | "open" | "closed";

export class Connection {
  state: LinkState = "connecting";
  /** Wall clock when the state was entered, and when the newest message came [ms]. */
  since = Date.now();
  heard = 0;
  bytes = 0;
  refused = 0;
  private socket: WebSocket | null = null;
  private pause = 250;
  private toAcknowledge: number[] = [];

  constructor(
    private readonly url: string,
    private readonly onMessage: (m: Message) => void,
    private readonly onState: (s: LinkState) => void,
  ) {
    this.open();
  }

  send(value: unknown): boolean {
    if (this.socket?.readyState !== WebSocket.OPEN) return false;
    this.socket.send(JSON.stringify(value));
    return true;
  }

  /** To be called when the frame is in the store: the next drawn picture shows it. */
  willShow(seq: number): void {
    this.toAcknowledge.push(seq);
  }

  /** To be called after a picture was drawn. */
  acknowledge(shownMs: number): void {
    for (const seq of this.toAcknowledge) this.send({ ack: seq, shown_ms: shownMs });
    this.toAcknowledge.length = 0;
  }

  private open(): void {
    const socket = new WebSocket(this.url);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    this.toAcknowledge.length = 0;
    socket.onopen = () => {
      this.pause = 250;
      this.enter("open");
    };
    socket.onmessage = (event) => this.take(event.data as ArrayBuffer);
    socket.onclose = () => {
      if (this.socket !== socket) return;
      this.enter("closed");
      setTimeout(() => this.open(), this.pause);
      this.pause = Math.min(this.pause * 1.7, 5000);
    };
  }

  private take(data: ArrayBuffer): void {
    this.heard = Date.now();
    this.bytes += data.byteLength;
    let message: Message;
    try {
      message = decode(data);
    } catch (error) {
      this.refused++;
      console.warn("message refused:", error);
      return;
    }
    this.onMessage(message);
  }

  private enter(state: LinkState): void {
    if (state !== this.state) this.since = Date.now();
    this.state = state;
    this.onState(state);
  }
}
