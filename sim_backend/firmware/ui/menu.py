"""The menus of the user interface as far as telegrams can observe them: the effects of keys.

Pictures and texts are LEGO's and are not drawn. Below the second level only the depth is followed, but for programs,
the choice of values for the data log, and the pages of radio, volume and sleep. Source: docs/firmware.md section 8.5.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from sim_backend.firmware.files.loader import Loader
from sim_backend.firmware.module import Clock
from sim_backend.firmware.radio import Radio
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.ui import log_menu
from sim_backend.firmware.ui import menu_drawing as drawing
from sim_backend.firmware.ui import menu_places as places
from sim_backend.firmware.ui import screen_marks as marks
from sim_backend.firmware.ui.key_input import KeyInput
from sim_backend.firmware.ui.keys import Key
from sim_backend.firmware.ui.log_menu import LogMenu
from sim_backend.firmware.ui.log_page import LogPage
from sim_backend.firmware.ui.menu_files import MenuFiles
from sim_backend.firmware.ui.menu_message import MenuMessage
from sim_backend.firmware.ui.menu_places import Places
from sim_backend.firmware.ui.menu_radio import MenuRadio
from sim_backend.firmware.ui.menu_settings import MenuSettings
from sim_backend.firmware.ui.menu_steps import MenuSteps
from sim_backend.firmware.ui.name_entry import NameEntry
from sim_backend.firmware.ui.page import CurrentPage, Page
from sim_backend.firmware.ui.program_steps import PROGRAM, ProgramSteps
from sim_backend.firmware.ui.registers import UiRegisters
from sim_backend.firmware.ui.screen_marks import NOTHING, Marks
from sim_backend.firmware.ui.sensor_view import SensorView
from sim_backend.firmware.ui.states import Place, UiState
from sim_backend.firmware.ui.view_page import ViewPage


class Menu:
    """The place in the menus.

    Args:
        registers: Holds the volume that is in use, and the flags.
        keys: The keys.
        current: The page that is shown besides the menus, and the states of the last key before it.
        settings: Settings that the menus change.
        loader: Holds the files.
        screen: Draws the menus.
        view: The value of a sensor or motor that is shown.
        logs: The data log.
        program: The program that is made on the brick.
        radio: The radio that the menus change.
        has_log: Whether the main menu has an item for it.

    Attributes:
        run_page: The page of a file that was run from its page.
        files: The lists of files.
        program: The program that is made on the brick.
        counters: The counts of passes of the pages.
    """

    run_page: Page
    _confirms: bool | None

    def __init__(
        self,
        clock: Clock,
        registers: UiRegisters,
        keys: KeyInput,
        current: CurrentPage,
        settings: MenuSettings,
        loader: Loader,
        screen: ScreenRefresh,
        view: SensorView,
        logs: LogMenu,
        program: ProgramSteps,
        radio: Radio,
        *,
        has_log: bool,
    ) -> None:
        self._registers, self._settings, self._view, self.logs, self.program = registers, settings, view, logs, program
        self._places = Places(loader.flash.names_ending, program, view, radio, logs if has_log else None)
        self._current, self._states = current, current.states
        self.files = MenuFiles(
            loader, settings.stored, self._places, self._states, leave=self._leave_list, sounds=program.waits
        )
        self._radio = MenuRadio(keys, radio, self._states)
        self._message = MenuMessage(clock, registers, keys, self._states, current.end)
        self._naming = NameEntry(registers, keys, program, self._states, self._leave_name)
        self._steps = MenuSteps(program, self._states, self._naming)
        self._view_page = ViewPage(clock, registers, keys, screen, view, self._leave_view)
        self._log_page = LogPage(clock, registers, keys, screen, logs, self._leave_log)
        self._file_page = Page(
            partial(self._draw_file_page, marks.PAGE), partial(self._draw_file_page, marks.FILE_NAME)
        )
        self.counters = self._view_page.drawn, self._view_page.checked, self._message.shown
        self.reset()

    def reset(self) -> None:
        """Go to the first item of the main menu; a data log that runs stays open, and a sensor keeps its type."""
        self._current.end()
        self._states.begin()
        self._place, self._shown, self._shows_file = [0], [0], False
        self.logs.log.runs = False
        self._confirms, self._asks = None, False
        self._volume = self._registers.volume

    @property
    def ignores_exit(self) -> bool:
        """Whether exit does nothing: a data log is to be stored or deleted."""
        return tuple(self._place[:-1]) == log_menu.START

    def show_file(self, name: str) -> None:
        """Go to the page of the file that was opened, or up from it to the list if the question was shown."""
        self._current.end()
        self._states.begin()
        self._shows_file = True
        self._place, self._confirms, self.files.chosen = [*places.PROGRAMS, 0, 0], None, name
        if self._asks:
            self._place.pop()

    def show_page(self) -> None:
        """Show the page again of the file that was started there."""
        self._current.end()
        self._states.begin(UiState.DRAWING)
        self._states.draw_last(marks.PAGE)

    def prepare(self) -> None:
        """Begin what state DRAWING shows: a page anew, or all of the page of a file that was opened."""
        self._asks, self._shown = self._confirms is not None, [*self._place]
        self._current.begin_anew()
        if not self._current.stays and self._states.begin_page():
            return
        if self._shows_file and not self._current.begins:
            self._shows_file = False
            self._states.begin(UiState.DRAWING)
            if places.is_list(tuple(self._place[:-1])):
                self._show_files()
            else:
                self._states.draw_last(*drawing.FILE_PAGE)

    def draw(self) -> None:
        """Draw a menu; that of a file that was opened goes on with its name for ever."""
        if self._shows_file:
            self._current.open(self._file_page)
        else:
            self._states.draw(self._drawn)

    def _draw_file_page(self, drawn: Marks) -> None:
        self._states.draw(drawn)
        self._registers.wake_in(1)

    def press(self, key: int) -> None:
        """Follow a key, a value of `Key`."""
        self._current.end()
        self._shows_file = False
        self._states.begin(UiState.DRAWING)
        if self._confirms is not None:
            self._answer(key)
        elif key in (Key.LEFT, Key.RIGHT):
            self._move(1 if key == Key.RIGHT else -1)
        elif key == Key.EXIT:
            self._leave()
        else:
            if len(self._place) == len(self._shown):  # left or right has not been drawn
                self._place = [*self._shown]
            self._enter()
        if self._states.shown and not self._current.exists and not self._states.draws:
            self._states.draw_last(self._drawn)

    @property
    def _drawn(self) -> Marks:
        """The drawing at the end of a key's states."""
        place = tuple(self._place)
        return drawing.page(place, makes_program=self._steps.has(place[:-1]))

    def _answer(self, key: int) -> None:
        """Answer whether to switch off."""
        if key in (Key.LEFT, Key.RIGHT):
            self._confirms = key == Key.LEFT
            return
        if self._confirms and key == Key.ENTER:
            self._registers.force_off = 1
            self._states.drop()
        self.reset()

    def _move(self, step: int) -> None:
        menu = tuple(self._place[:-1])
        if places.asks_to_delete(menu):
            self._place[-1] = places.NO if step > 0 else places.YES
            self._states.draw_last(*drawing.ERASE_ANSWER[: 1 + (menu[:-1] == places.ERASE)])
            return
        items = self.files.shown if places.is_list(menu) else self._places.items(menu)
        self._place[-1] = self._places.next_to(tuple(self._place), step, items)
        if menu == places.VOLUME:
            self._states.act(partial(self._settings.set_volume, self._place[-1]))
        if menu in (places.VOLUME, places.SLEEP):
            self._states.draw_last(marks.BAR, NOTHING)
        elif places.lists_connections(menu):
            self._states.draw_last(drawing.CONNECTIONS[1])
        if places.action(tuple(self._place)) == places.RUN:
            self._states.draw_last(*drawing.FILE_PAGE)
        self._draw_slowly()
        if places.is_list(menu):
            self.files.move(menu, self._place[-1])

    def _leave(self) -> None:
        if len(self._place) == 1:
            self._confirms = True
            return
        if places.asks_to_delete(tuple(self._place[:-1])) and self._place[-1] == places.YES:
            self._place.pop()
        if tuple(self._place[:-1]) == places.VOLUME:
            self._states.act_last(partial(self._settings.set_volume, self._volume))
            self._states.show(UiState.EXIT)
            self._place.pop()
        left, self._place = self._place, self._place[:-1]
        if tuple(self._place) == places.SWITCH:
            self._place.pop()
        menu = tuple(self._place[:-1])
        self._steps.leave(tuple(left))
        if places.is_list(menu):
            self._show_files()
        if tuple(left) == log_menu.START:
            self._states.draw_last(*drawing.OPENED[log_menu.DATA_LOG])
        self._draw_slowly()

    def _leave_view(self) -> None:
        """Leave the value of a sensor or motor for the list of items to show."""
        self._current.end()
        self._place = self._place[:-1] or [0]  # a question of the radio has led to the main menu
        self._states.begin(UiState.DRAWING)
        self._states.act(self._view_page.end)
        self._states.show(UiState.EXIT)
        self._states.draw_last(self._drawn)
        self._draw_slowly()

    def _leave_log(self, message: Sequence[Marks]) -> None:
        """Leave the data log, perhaps by a message."""
        self._current.end()
        self._place, self._states.left = self.logs.leave(message, self._log_page.end)

    def _leave_name(self, ended: bool) -> None:
        """Leave the page for a name; if it has `ended`, for the main menu."""
        self._current.end()
        if ended:
            self._place = [PROGRAM]

    def _draw_slowly(self) -> bool:
        """Draw an item of the list of items to show, if that takes longer."""
        slow = self._view.is_slow(tuple(self._place))
        if slow:
            self._view.clear()
            self._states.draw_last(marks.PAGE, *drawing.OPENED[places.VALUES])
        return slow

    def _show_files(self) -> None:
        """Show a list after the page of a file."""
        self._place[-1] = 0
        self.files.show_first(tuple(self._place[:-1]))

    def _leave_list(self) -> None:
        """Lead up from a list without files."""
        self._place.pop()
        self._states.left.clear()
        self._states.show(UiState.EXIT)
        self._states.draw_last(self._drawn)

    def _enter(self) -> None:
        menu, place = tuple(self._place[:-1]), tuple(self._place)
        if menu == places.VOLUME:
            self._volume = place[-1]
            self._states.show(UiState.EXIT)
            self._leave()
            self._states.act(partial(self._settings.store_volume, place[-1]))
        elif menu == places.SLEEP:
            self._states.act(partial(self._settings.store_sleep, self._place.pop()))
            self._states.show(UiState.EXIT)
        elif places.action(place) == places.RUN:
            self._current.open(self.run_page)
        elif places.is_page(menu[:-1]):
            self._place.pop()
            self._answer_page(places.action(menu), place[-1])
        elif self._view.opens(place):
            self._current.open(self._view_page.page)
        elif menu == places.ERASE:
            self._place.append(places.NO)
            self._states.draw_last(NOTHING, *drawing.ERASE_ANSWER)
        elif menu[:-1] == places.ERASE:
            self._place.pop()
            if place[-1] == places.YES:
                self.files.erase(self._place.pop())
        elif place == log_menu.START:
            self._current.open(self._log_page.page)
        elif menu == log_menu.START:
            self._place = [*log_menu.DATA_LOG]
            self.files.keep_log(place[-1])
        elif self.logs.follows(place):
            if self.logs.refuses(place):
                self._current.open(self._message.refused)
            self._place, self._states.left[-1:] = self.logs.enter(place)
        elif self._steps.follows(place):
            self._place = self._steps.enter(place)
            if self._steps.names(place):
                self._current.open(self._naming.page, begins=False)
        elif place == places.VERSION:
            self._message.show_version()
            self._current.open(self._message.version)
        elif self._radio.follows(place):
            self._place = self._radio.enter(place)
        else:
            if place == places.TRY_ME:
                self._states.draw_last(marks.MENU)
                self._states.show(UiState.ENTER)
            self._open(place)

    def _answer_page(self, action: int | None, answer: int) -> None:
        """Send a file, or delete it if that is the answer."""
        if action == places.SEND:
            self.files.send()
        elif answer == places.YES:
            self._place.pop()
            self._place[-1] = 0
            self.files.delete(tuple(self._place[:-1]))

    def _open(self, place: Place) -> None:
        first = self._radio.first(place)
        if place == log_menu.DATA_LOG:
            self.logs.clear()
        elif place == places.VALUES:
            self._view.clear()
        elif place == places.VOLUME:
            first = self._volume = self._settings.stored.volume
        elif place == places.SLEEP:
            first = self._settings.stored.sleep
        elif places.is_page(place):
            first = places.first_action(place)
        self._place.append(first)
        if places.is_list(place):
            self.files.enter(place)
        elif places.is_list(place[:-1]):
            page = drawing.FILE_PAGE if places.RUN in places.actions(place) else (NOTHING,)
            self._states.draw_last(NOTHING, *page)
        if place in (places.VOLUME, places.SLEEP):
            self._states.draw_last(marks.PAGE, marks.BAR, NOTHING)
        elif places.lists_connections(place):
            self._states.draw_last(marks.MENU, drawing.CONNECTIONS[0])
        elif self._steps.has(place):
            self._steps.open(place)
        elif place[0] in places.SLOW and not self._draw_slowly():
            self._states.draw_last(*drawing.OPENED.get(place, (NOTHING, NOTHING)))
