"""A network camera to try things with: serves what ffmpeg reads as H.264 over RTSP (TCP and UDP), for tests and for
the guide deploy/own-camera.md. No server for the outside: it listens on 127.0.0.1 alone.

    rtsp_server.py [--port N] [--ffmpeg PATH] FFMPEG_INPUT_ARGUMENTS...
    rtsp_server.py --port 8554 -re -stream_loop -1 -i room.mp4

Prints its address once pictures are there. Only what RTSP needs (RFC 2326): OPTIONS, DESCRIBE, SETUP, PLAY, TEARDOWN.
"""
import ctypes
import pathlib
import re
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time

PICTURES_WITHIN_S = 60
PR_SET_PDEATHSIG = 1


def udp_pair():
    """Two sockets on neighbouring ports, the first of them even, as RTP has it (RFC 3550, section 11)."""
    for _ in range(100):
        first = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        first.bind(("127.0.0.1", 0))
        port = first.getsockname()[1]
        second = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            if port % 2 == 0:
                second.bind(("127.0.0.1", port + 1))
                return first, second, port
        except OSError:
            pass
        first.close()
        second.close()
    raise SystemExit("rtsp_server: no two neighbouring ports are free")


def start_ffmpeg(ffmpeg, arguments, rtp_port, sdp):
    command = [ffmpeg, "-hide_banner", "-loglevel", "error", "-nostdin", *arguments, "-an", "-c:v", "libx264",
               "-preset", "ultrafast", "-tune", "zerolatency", "-pix_fmt", "yuv420p", "-g", "15", "-threads", "1",
               "-bsf:v", "dump_extra", "-f", "rtp", "-sdp_file", str(sdp),
               f"rtp://127.0.0.1:{rtp_port}?rtcpport={rtp_port + 1}&pkt_size=1300"]
    # It ends with us, however we end.
    process = subprocess.Popen(command, preexec_fn=lambda: ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL))
    end = time.monotonic() + PICTURES_WITHIN_S
    while not (sdp.exists() and "m=video" in sdp.read_text()):
        if process.poll() is not None or time.monotonic() > end:
            process.kill()
            raise SystemExit("rtsp_server: ffmpeg gives no picture")
        time.sleep(0.05)
    return process


def session_description(sdp):
    """ffmpeg's, for somebody who asks over RTSP: no port, and a name for the one stream."""
    lines = [line for line in sdp.read_text().splitlines() if line and not line.startswith("SDP:")]
    lines = [re.sub(r"^m=video \d+", "m=video 0", line) for line in lines]
    return "\r\n".join(lines + ["a=control:streamid=0", ""])


class Client:
    """One connection; plays either into it (interleaved) or beside it (UDP)."""

    def __init__(self, connection, server):
        self.connection = connection
        self.server = server
        self.lock = threading.Lock()
        self.udp_ports = None
        self.playing = False

    def serve(self):
        try:
            with self.connection, self.connection.makefile("rb") as lines:
                while self.answer(lines):
                    pass
        except OSError:
            pass
        finally:
            self.playing = False
            self.server.clients.discard(self)

    def answer(self, lines):
        first = lines.read(1)
        if first == b"$":  # RTCP that the client sends in between
            head = lines.read(3)
            lines.read(int.from_bytes(head[1:3], "big"))
            return True
        request = (first + lines.readline()).decode("latin-1").split()
        headers = {}
        while (line := lines.readline().decode("latin-1").strip()):
            name, _, value = line.partition(":")
            headers[name.lower()] = value.strip()
        if len(request) < 3:
            return False
        reply, body = self.reply(request[0], request[1], headers)
        text = "".join(f"{line}\r\n" for line in ["RTSP/1.0 200 OK", f"CSeq: {headers.get('cseq', '0')}", *reply])
        with self.lock:
            self.connection.sendall(f"{text}\r\n{body}".encode())
        if request[0] == "PLAY":
            self.playing = True
        return request[0] != "TEARDOWN"

    def reply(self, method, url, headers):
        if method == "OPTIONS":
            return ["Public: OPTIONS, DESCRIBE, SETUP, PLAY, TEARDOWN"], ""
        if method == "DESCRIBE":
            body = self.server.description
            return ["Content-Type: application/sdp", f"Content-Base: {url.rstrip('/')}/",
                    f"Content-Length: {len(body)}"], body
        if method == "SETUP":
            asked = headers.get("transport", "")
            ports = re.search(r"client_port=(\d+)-(\d+)", asked)
            if ports:
                self.udp_ports = int(ports[1]), int(ports[2])
                return [f"Transport: RTP/AVP;unicast;client_port={ports[1]}-{ports[2]};"
                        f"server_port={self.server.port}-{self.server.port + 1}", "Session: 1"], ""
            return ["Transport: RTP/AVP/TCP;unicast;interleaved=0-1", "Session: 1"], ""
        return ["Session: 1"], ""

    def send(self, channel, packet):
        if not self.playing:
            return
        try:
            if self.udp_ports:
                self.server.sockets[channel].sendto(packet, ("127.0.0.1", self.udp_ports[channel]))
                return
            with self.lock:
                self.connection.sendall(b"$" + bytes([channel]) + len(packet).to_bytes(2, "big") + packet)
        except OSError:
            self.playing = False


class Server:
    def __init__(self, description, sockets, port):
        self.description = description
        self.sockets = sockets
        self.port = port
        self.clients = set()

    def relay(self, channel):
        while True:
            packet = self.sockets[channel].recv(65536)
            for client in list(self.clients):
                client.send(channel, packet)

    def run(self, listener):
        for channel in (0, 1):
            threading.Thread(target=self.relay, args=(channel,), daemon=True).start()
        while True:
            client = Client(listener.accept()[0], self)
            self.clients.add(client)
            threading.Thread(target=client.serve, daemon=True).start()


def main(arguments):
    port, ffmpeg = 0, "ffmpeg"
    while arguments and arguments[0] in ("--port", "--ffmpeg"):
        if arguments[0] == "--port":
            port = int(arguments[1])
        else:
            ffmpeg = arguments[1]
        arguments = arguments[2:]
    if not arguments:
        raise SystemExit(__doc__)
    listener = socket.socket()
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    listener.bind(("127.0.0.1", port))
    rtp, rtcp, rtp_port = udp_pair()
    with tempfile.TemporaryDirectory() as folder:
        sdp = pathlib.Path(folder) / "stream.sdp"
        start_ffmpeg(ffmpeg, arguments, rtp_port, sdp)
        server = Server(session_description(sdp), (rtp, rtcp), rtp_port)
    listener.listen()
    print(f"rtsp://127.0.0.1:{listener.getsockname()[1]}/camera", flush=True)
    server.run(listener)


if __name__ == "__main__":
    try:
        main(sys.argv[1:])
    except KeyboardInterrupt:
        pass
