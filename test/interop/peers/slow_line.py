"""A line that takes its time: slow_line.py PORT TARGETPORT SECONDS. What comes to the port goes to the target on 127.0.0.1,
so much later, and back."""
import asyncio
import sys

port, target, delay = int(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3])


async def carry(reader, writer):
    """Keeps the order, and the distances in time."""
    waiting = asyncio.Queue(64)

    async def deliver():
        while item := await waiting.get():
            at, data = item
            await asyncio.sleep(max(0.0, at - loop.time()))
            writer.write(data)
            await writer.drain()
        writer.close()

    loop = asyncio.get_running_loop()
    delivery = asyncio.create_task(deliver())
    try:
        while data := await reader.read(65536):
            await waiting.put((loop.time() + delay, data))
    except OSError:
        pass
    await waiting.put(None)
    await asyncio.gather(delivery, return_exceptions=True)


async def accept(reader, writer):
    far_reader, far_writer = await asyncio.open_connection("127.0.0.1", target)
    await asyncio.gather(carry(reader, far_writer), carry(far_reader, writer))


async def main():
    server = await asyncio.start_server(accept, "0.0.0.0", port)
    print("ready", flush=True)
    await server.serve_forever()


asyncio.run(main())
