"""The style of reports in a browser."""

from playwright.sync_api import Browser

from fogsim.recorders.templating import render


def test_wide_tables_and_long_names_fit_on_a_phone(browser: Browser) -> None:
    cells = "".join(f'<th class="value">number {column}</th>' for column in range(12))
    style = render("page.css")
    page = browser.new_page(viewport={"width": 390, "height": 844})
    page.set_content(f"<style>{style}</style><h1>{'long_name_' * 8}</h1><table><tr>{cells}</tr></table>")
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    page.close()
