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
from sim_backend.firmware.ui.key_states import KeyStates
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
from sim_backend.firmware.ui.page import Page
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
        states: The states of the last key.
        files: The lists of files.
        program: The program that is made on the brick.
        counters: The counts of passes of the pages.
    """

    run_page: Page
    _page: Page | None
    _confirms: bool | None

    def __init__(
        self,
        clock: Clock,
        registers: UiRegisters,
        keys: KeyInput,
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
        self.states = KeyStates(registers, screen)
        self.files = MenuFiles(
            loader, settings.stored, self._places, self.states, leave=self._leave_list, sounds=program.waits
        )
        self._radio = MenuRadio(keys, radio, self.states)
        self._message = MenuMessage(clock, registers, keys, self.states, self._end_page)
        self._naming = NameEntry(registers, keys, program, self.states, self._leave_name)
        self._steps = MenuSteps(program, self.states, self._naming)
        self._view_page = ViewPage(clock, registers, keys, screen, view, self._leave_view)
        self._log_page = LogPage(clock, registers, keys, screen, logs, self._leave_log)
        self._file_page = Page(
            partial(self._draw_file_page, marks.PAGE), partial(self._draw_file_page, marks.FILE_NAME)
        )
        self.counters = self._view_page.drawn, self._view_page.checked, self._message.shown
        self.reset()

    def reset(self) -> None:
        """Go to the first item of the main menu; a data log that runs stays open, and a sensor keeps its type."""
        self._end_page()
        self._place, self._shows_file = [0], False
        self.logs.log.runs = False
        self._confirms, self._asks = None, False
        self._volume = self._registers.volume

    @property
    def keeps_page(self) -> bool:
        """Whether there is a page to which all states of the menus lead back."""
        return self._page is not None and self._page.stays

    @property
    def ignores_exit(self) -> bool:
        """Whether exit does nothing: a data log is to be stored or deleted."""
        return tuple(self._place[:-1]) == log_menu.START

    def shows(self, page: Page) -> bool:
        """Return whether a page has begun, and has not ended."""
        return self._page is page and not self._begins

    def open(self, page: Page) -> None:
        """Show a page from the next pass of state DRAWING on."""
        self.states.drop()
        self._page, self._begins = page, True

    def _end_page(self) -> None:
        self._page, self._begins = None, False

    def drop(self) -> None:
        """Drop the states to come and what they draw; a page that stays can continue."""
        if self._page is self._naming.page:
            self._naming.interrupt()
        self.states.drop()
        if not self.keeps_page:
            self._end_page()

    def show_file(self, name: str) -> None:
        """Go to the page of the file that was opened, or up from it to the list if the question was shown."""
        self._end_page()
        self._shows_file = True
        self._place, self._confirms, self.files.chosen = [*places.PROGRAMS, 0, 0], None, name
        if self._asks:
            self._place.pop()

    def show_page(self) -> None:
        """Show the page again of the file that was started there."""
        self._end_page()
        self.states.begin(UiState.DRAWING)
        self.states.draw_last(marks.PAGE)

    def go_on(self) -> bool:
        """Go on to the next state of a key, if there is one; return whether there is."""
        left = self.states.left
        return bool(left) and left[0].state == self._registers.state and self.states.go_on()

    def prepare(self) -> None:
        """Begin what state DRAWING shows: a page anew, or all of the page of a file that was opened."""
        self._begins = self._begins or self.keeps_page
        self._asks = self._confirms is not None
        if self._shows_file and not self._begins:
            self._shows_file = False
            self.states.begin(UiState.DRAWING)
            if places.is_list(tuple(self._place[:-1])):
                self._show_files()
            else:
                self.states.draw_last(*drawing.FILE_PAGE)

    def draw(self) -> None:
        """Show a page, pass by pass; when there is nothing left of it, take keys."""
        has_states = self.states.shown
        if has_states:
            if self.go_on():
                return
        elif self._page is None and self._shows_file:
            self._page, self._begins = self._file_page, True
        elif self._page is None:
            self.states.draw(self._drawn)
        if self._page is None:
            self._registers.go_to(UiState.WAITING)
            return
        if self._begins:
            self._begins = False
            self._page.begin()
        elif has_states:
            self._registers.wake_in(1)
        else:
            self._page.go_on()
        if self.states.shown:
            self._registers.go_to(self.states.left[0].state)

    def _draw_file_page(self, drawn: Marks) -> None:
        """Draw the page of a file that was opened, which goes on with its name for ever."""
        self.states.draw(drawn)
        self._registers.wake_in(1)

    def press(self, key: int) -> None:
        """Follow a key, a value of `Key`."""
        self._end_page()
        self._shows_file = False
        self.states.begin(UiState.DRAWING)
        if self._confirms is not None:
            self._answer(key)
        elif key in (Key.LEFT, Key.RIGHT):
            self._move(1 if key == Key.RIGHT else -1)
        elif key == Key.EXIT:
            self._leave()
        else:
            self._enter()
        if self.states.shown and self._page is None and not self.states.draws:
            self.states.draw_last(self._drawn)

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
            self.states.drop()
        self.reset()

    def _move(self, step: int) -> None:
        menu = tuple(self._place[:-1])
        if places.asks_to_delete(menu):
            self._place[-1] = places.NO if step > 0 else places.YES
            self.states.draw_last(*drawing.ERASE_ANSWER[: 1 + (menu[:-1] == places.ERASE)])
            return
        items = self.files.shown if places.is_list(menu) else self._places.items(menu)
        self._place[-1] = self._places.next_to(tuple(self._place), step, items)
        if menu == places.VOLUME:
            self.states.act(partial(self._settings.set_volume, self._place[-1]))
        if menu in (places.VOLUME, places.SLEEP):
            self.states.draw_last(marks.BAR, NOTHING)
        elif places.lists_connections(menu):
            self.states.draw_last(drawing.CONNECTIONS[1])
        if places.action(tuple(self._place)) == places.RUN:
            self.states.draw_last(*drawing.FILE_PAGE)
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
            self.states.act_last(partial(self._settings.set_volume, self._volume))
            self.states.show(UiState.EXIT)
            self._place.pop()
        left, self._place = self._place, self._place[:-1]
        if tuple(self._place) == places.SWITCH:
            self._place.pop()
        menu = tuple(self._place[:-1])
        self._steps.leave(tuple(left))
        if places.is_list(menu):
            self._show_files()
        if tuple(left) == log_menu.START:
            self.states.draw_last(*drawing.OPENED[log_menu.DATA_LOG])
        self._draw_slowly()

    def _leave_view(self) -> None:
        """Leave the value of a sensor or motor for the list of items to show."""
        self._end_page()
        self._place = self._place[:-1] or [0]  # a question of the radio has led to the main menu
        self.states.begin(UiState.DRAWING)
        self.states.act(self._view_page.end)
        self.states.show(UiState.EXIT)
        self.states.draw_last(self._drawn)
        self._draw_slowly()

    def _leave_log(self, message: Sequence[Marks]) -> None:
        """Leave the data log, perhaps by a message."""
        self._end_page()
        self._place, self.states.left = self.logs.leave(message, self._log_page.end)

    def _leave_name(self, ended: bool) -> None:
        """Leave the page for a name; if it has `ended`, for the main menu."""
        self._end_page()
        if ended:
            self._place = [PROGRAM]

    def _draw_slowly(self) -> bool:
        """Draw an item of the list of items to show, if that takes longer."""
        slow = self._view.is_slow(tuple(self._place))
        if slow:
            self._view.clear()
            self.states.draw_last(marks.PAGE, *drawing.OPENED[places.VALUES])
        return slow

    def _show_files(self) -> None:
        """Show a list after the page of a file."""
        self._place[-1] = 0
        self.files.show_first(tuple(self._place[:-1]))

    def _leave_list(self) -> None:
        """Lead up from a list without files."""
        self._place.pop()
        self.states.left.clear()
        self.states.show(UiState.EXIT)
        self.states.draw_last(self._drawn)

    def _enter(self) -> None:
        menu, place = tuple(self._place[:-1]), tuple(self._place)
        if menu == places.VOLUME:
            self._volume = place[-1]
            self.states.show(UiState.EXIT)
            self._leave()
            self.states.act(partial(self._settings.store_volume, place[-1]))
        elif menu == places.SLEEP:
            self.states.act(partial(self._settings.store_sleep, self._place.pop()))
            self.states.show(UiState.EXIT)
        elif places.action(place) == places.RUN:
            self._open_at_end(self.run_page)
        elif places.is_page(menu[:-1]):
            self._place.pop()
            self._answer_page(places.action(menu), place[-1])
        elif self._view.opens(place):
            self._open_at_end(self._view_page.page)
        elif menu == places.ERASE:
            self._place.append(places.NO)
            self.states.draw_last(NOTHING, *drawing.ERASE_ANSWER)
        elif menu[:-1] == places.ERASE:
            self._place.pop()
            if place[-1] == places.YES:
                self.files.erase(self._place.pop())
        elif place == log_menu.START:
            self._open_at_end(self._log_page.page)
        elif menu == log_menu.START:
            self._place = [*log_menu.DATA_LOG]
            self.files.keep_log(place[-1])
        elif self.logs.follows(place):
            if self.logs.refuses(place):
                self._open_at_end(self._message.refused)
            self._place, self.states.left[-1:] = self.logs.enter(place)
        elif self._steps.follows(place):
            self._place = self._steps.enter(place)
            if self._steps.names(place):
                self._page = self._naming.page
        elif place == places.VERSION:
            self._message.show_version()
            self._open_at_end(self._message.version)
        elif self._radio.follows(place):
            self._place = self._radio.enter(place)
        else:
            if place == places.TRY_ME:
                self.states.draw_last(marks.MENU)
                self.states.show(UiState.ENTER)
            self._open(place)

    def _open_at_end(self, page: Page) -> None:
        """Show a page after the states of a key."""
        self._page, self._begins = page, True

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
            self.states.draw_last(NOTHING, *page)
        if place in (places.VOLUME, places.SLEEP):
            self.states.draw_last(marks.PAGE, marks.BAR, NOTHING)
        elif places.lists_connections(place):
            self.states.draw_last(marks.MENU, drawing.CONNECTIONS[0])
        elif self._steps.has(place):
            self._steps.open(place)
        elif place[0] in places.SLOW and not self._draw_slowly():
            self.states.draw_last(*drawing.OPENED.get(place, (NOTHING, NOTHING)))
