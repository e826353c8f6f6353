"""A radio without radio: Bumble's virtual controllers on one link, and the wearable's program at one of them.

Bumble 0.0.236's controller lacks what a wearable asks for; `Controller` below adds it, and says where it
stays silent on purpose.
"""

import asyncio
import os
import re
import signal
import socket

from bumble import att, controller, core, hci, link, ll, smp
from bumble.host import Host
from bumble.device import Device
from bumble.transport import tcp_server
from bumble.transport.common import AsyncPipeSink

# As the program has it (`ADDRESS` in src/main.rs), most significant byte first.
WEARABLE = hci.Address("C7:0A:70:5E:00:01", hci.Address.RANDOM_DEVICE_ADDRESS)
# Nothing on the virtual air takes this long; a machine under load may.
PATIENCE_S = 30.0
# The channel of attributes, and the answer to a wish for an MTU on it.
MTU_RESPONSE = bytes([4, 0, att.Opcode.ATT_EXCHANGE_MTU_RESPONSE])
SMALLEST_MTU = 23


# Bumble describes every packet in words, also for a log that nobody reads: half of its time.
for described in (hci.HCI_AclDataPacket, hci.HCI_Command, hci.HCI_Event, att.ATT_PDU, smp.SMP_Command):
    described.__str__ = object.__repr__


class Controller(controller.Controller):
    """Bumble's controller, with longer packets and the commands that it does not know."""

    le_acl_data_packet_length = 251
    # As many packets in flight as its field can hold: a test that the machine slows down is no stalled link.
    total_num_le_acl_data_packets = 255

    def __init__(self, *arguments, answers_phy=True, places=None, **named):
        super().__init__(*arguments, **named)
        self.answers_phy = answers_phy
        self.held = None
        # The answer to a wish for a larger MTU says that there is none.
        self.small_mtu = False
        if places:
            self.total_num_le_acl_data_packets = places

    def on_hci_reset_command(self, command):
        """Bumble's keeps its links over a reset; a controller ends them."""
        for connection in list(self.le_connections.values()):
            connection.send_ll_control_pdu(ll.TerminateInd(hci.HCI_ErrorCode.REMOTE_DEVICE_TERMINATED_CONNECTION_DUE_TO_POWER_OFF_ERROR))
        self.le_connections.clear()
        self.le_legacy_advertiser.stop()
        return super().on_hci_reset_command(command)

    def stall(self):
        """Nothing that the host hands over gets through, or is reported as sent."""
        self.held = []

    def recover(self):
        held, self.held = self.held, None
        for packet in held:
            super().on_hci_acl_data_packet(packet)

    def on_hci_acl_data_packet(self, packet):
        if self.small_mtu and packet.data[2:5] == MTU_RESPONSE:
            packet.data = packet.data[:5] + SMALLEST_MTU.to_bytes(2, "little")
        if self.held is None:
            super().on_hci_acl_data_packet(packet)
        else:
            self.held.append(packet)

    def on_hci_le_remove_device_from_resolving_list_command(self, command):
        """The stock controller never answers this one either."""
        self.send_hci_packet(hci.HCI_Command_Complete_Event(
            num_hci_command_packets=1, command_opcode=command.op_code,
            return_parameters=hci.HCI_StatusReturnParameters(hci.HCI_ErrorCode.SUCCESS)))

    def on_hci_le_set_phy_command(self, command):
        """The stock controller never answers this one."""
        if not self.answers_phy:
            return
        self._send_hci_command_status(hci.HCI_COMMAND_STATUS_PENDING, command.op_code)
        self.send_hci_packet(hci.HCI_LE_PHY_Update_Complete_Event(
            status=hci.HCI_ErrorCode.SUCCESS, connection_handle=command.connection_handle, tx_phy=2, rx_phy=2))

    def on_hci_le_set_data_length_command(self, command):
        self.send_hci_packet(hci.HCI_LE_Data_Length_Change_Event(
            connection_handle=command.connection_handle, max_tx_octets=command.tx_octets,
            max_tx_time=command.tx_time, max_rx_octets=command.tx_octets, max_rx_time=command.tx_time))
        return hci.HCI_StatusAndConnectionHandleReturnParameters(
            status=hci.HCI_ErrorCode.SUCCESS, connection_handle=command.connection_handle)


def radio_of(device):
    """The controller that a host in this process runs on."""
    return device.host.hci_sink.sink


class Air:
    """One link, the controllers on it, and the wearable's program."""

    def __init__(self, folder):
        self.flash = folder / "flash"
        self.link = link.LocalLink()
        self.programs = []
        self.wearables = []
        self.hosts = 0

    async def wearable(self, *options, **oddities):
        """Starts the wearable's program, and waits until it advertises."""
        wearable = await self._start(
            Wearable, "wearable", "TONUS_AIR", "--flash", str(self.flash), *options, **oddities)
        self.wearables.append(wearable)
        await wearable.says("notice Advertising")
        return wearable

    async def central(self, bond, *options):
        """Starts a host on another stack, a program too; it keeps its bond in that file."""
        return await self._start(
            Program, "central", "TONUS_AIR_CENTRAL", "--wearable", str(WEARABLE).split("/")[0], "--bond", str(bond), *options)

    async def session(self, which, *options):
        """Starts the host's own logic on another stack."""
        return await self._start(Program, "central", "TONUS_AIR_CENTRAL", "--session", which, *options)

    async def _start(self, kind, name, variable, *options, **oddities):
        """Starts a program at a controller of its own."""
        # asyncio turns Nagle's algorithm off where a socket says that it is TCP; with it each answer is 40 ms late.
        listening = socket.socket(proto=socket.IPPROTO_TCP)
        listening.bind(("127.0.0.1", 0))
        port = listening.getsockname()[1]
        transport = await tcp_server.open_tcp_server_transport_with_socket(listening)
        radio = Controller(name, host_source=transport.source, host_sink=transport.sink, link=self.link, **oddities)
        process = await asyncio.create_subprocess_exec(
            os.environ[variable], f"127.0.0.1:{port}", *options, env=os.environ | {"RUST_BACKTRACE": "0"},
            stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.STDOUT)
        program = kind(name, process, transport, radio, oddities)
        self.programs.append(program)
        return program

    async def host(self, address=None, delegate=None):
        """A powered host with an address of its own, or the one given."""
        self.hosts += 1
        address = address or f"F0:00:00:00:00:{self.hosts:02X}"
        radio = Controller(f"host {self.hosts}", link=self.link)
        device = Device(name="host", address=hci.Address(address), host=Host(radio, AsyncPipeSink(radio)))
        await device.power_on()
        return device

    async def lose(self, wearable):
        """Both sides hear nothing any more, as when the wearer walks away."""
        for radio in self.link.controllers:
            for connection in list(radio.le_connections.values()):
                radio.on_le_disconnected(connection, hci.HCI_ErrorCode.CONNECTION_TIMEOUT_ERROR)
        await wearable.says("notice Disconnected")

    async def silence(self):
        """The wearable is off: its controller leaves the link, and hosts lose theirs."""
        for radio in list(self.link.controllers):
            for connection in list(radio.le_connections.values()):
                radio.on_le_disconnected(connection, hci.HCI_ErrorCode.CONNECTION_TIMEOUT_ERROR)
            if radio.name == "wearable":
                # Or it would go on for ever, and a host would connect to nobody.
                radio.le_legacy_advertiser.stop()
                self.link.remove_controller(radio)

    def throw(self, device, packet):
        """Sends bytes as they are, where Bumble would complete them."""
        self.link.send_acl_data(radio_of(device), WEARABLE, core.PhysicalTransport.LE, packet)

    async def close(self):
        for program in self.programs:
            await program.stop()


class Program:
    """A program at a controller, and its console."""

    def __init__(self, name, process, transport, radio, oddities):
        self.name = name
        self.process = process
        self.stopped = False
        self.transport = transport
        self.radio = radio
        self.oddities = oddities
        self.lines = []
        self.read = 0
        self.news = asyncio.Event()
        self.reader = asyncio.create_task(self._read())

    async def _read(self):
        while line := await self.process.stdout.readline():
            self.lines.append(line.decode(errors="replace").rstrip())
            self.news.set()
        self.lines.append("ended")
        self.news.set()

    async def says(self, pattern, limit_s=PATIENCE_S):
        """Waits for a line that matches, after the one that the last call found."""
        self.read, found = await self._find(pattern, self.read, limit_s)
        return found

    async def _find(self, pattern, start, limit_s):
        async def wait():
            at = start
            while True:
                while at < len(self.lines):
                    at += 1
                    if found := re.match(pattern, self.lines[at - 1]):
                        return at, found
                    if self.lines[at - 1] == "ended":
                        raise AssertionError(f"the {self.name} ended before it said {pattern!r}: {self.lines[-12:]}")
                self.news.clear()
                await self.news.wait()
        try:
            return await asyncio.wait_for(wait(), limit_s)
        except TimeoutError:
            raise AssertionError(f"the {self.name} did not say {pattern!r}: {self.lines[-12:]}") from None

    def said(self, pattern):
        """The lines so far that match."""
        return [line for line in self.lines if re.match(pattern, line)]

    async def type(self, line):
        self.process.stdin.write(f"{line}\n".encode())
        await self.process.stdin.drain()

    def is_running(self):
        return self.process.returncode is None

    async def stop(self):
        """Cuts the power."""
        self.stopped = self.is_running()
        if self.is_running():
            self.process.send_signal(signal.SIGKILL)
        await self.process.wait()
        await self.reader
        self.transport.server.close()


class Wearable(Program):
    """The wearable's program: what it shows, and its button."""

    keys_read = 0

    async def passkey(self):
        """The digits that the console shows for the pairing now under way. Looked for apart from what a
        scenario waits for, since a person types while it runs."""
        self.keys_read, found = await self._find(r"notice Passkey\((\d+)\)", self.keys_read, PATIENCE_S)
        return int(found.group(1))

    async def command(self, word, answer):
        await self.type(word)
        return await self.says(answer)

    async def press(self):
        """Presses the pairing button."""
        await self.command("press", "pressed")

    async def refused(self):
        """Frames that the wearable refused since its start."""
        return int((await self.command("refused", r"refused (\d+)")).group(1))
