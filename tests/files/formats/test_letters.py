"""Encodings of text in single bytes: each European one is guessed or at least taken, those of East Asia are asked about."""

from pathlib import Path

import pytest

from app.files.aqdef.description import encoding_of as of_aqdef
from app.files.formats.column_names import NAMES
from app.files.formats.delimited import ENCODINGS, Unusable, encoding_of
from app.files.formats.letters import TO_NAME, guessed

HEADINGS = [name for names in NAMES.values() for name in names if not name.isascii()]
EUROPE = ("cp1252", "cp1250", "cp1251", "iso-8859-2", "iso-8859-5", "cp1253", "cp1254", "cp1257")
FURTHER = (
    "Διάμετρος;Μέτρηση;Ημερομηνία;Εξάρτημα Α", "Çap;Ölçülen değer;Işlem şekli;İç çap", "Średnica wewnętrzna;Głębokość rowka;Część nr 3",
    "Průměr otvoru;Vzdálenost;Hloubka drážky Ø12", "Furat átmérője;Mélység;Sugár", "Prečnik žleba;Dužina;Širina čaure Đ2",
    "Диаметр отверстия;Глубина паза;Ширина", "Пречник жлеба;Дужина чауре;Ђ2;Њ3;Џ4", "Diamètre d’alésage;Écart « réel »;N° de pièce;Défaut ±5 µm",
    "Diámetro interior;¿Conforme?;Posición ±0,05", "Diâmetro do furo;Posição;Nº da peça", "Größe;Außen-Ø;Rauhtiefe Rz [µm];Temperatur °C;Fläche mm²",
    "Borrning;Mätvärde;Håldiameter", "Läbimõõt;Skersmuo;Šėtas", "№;Размер, мм;Отклонение ±0,05 мкм",
)  # fmt: skip
ASIA = {
    "cp932": ("部品番号,測定値,測定日時", "外径,設計値,公差上限,判定", "サイズ,メジャー,ワーク番号"),
    "gb18030": ("零件号,测量值,日期时间", "尺寸,公差,直径,实测值", "编号;特征;上偏差;下偏差"),
    "big5": ("外徑,實測值,時間", "零件,尺寸,量測值", "編號;公差;深度"),
    "cp949": ("부품번호,측정값,일시", "치수,공차,직경", "번호;외경;측정시간"),
}


def encodable(text: str, encoding: str) -> bool:
    try:
        return text.encode(encoding).decode(encoding) == text
    except UnicodeEncodeError:
        return False


@pytest.mark.parametrize("encoding", EUROPE)
def test_no_european_heading_is_refused(encoding: str) -> None:
    texts = [*HEADINGS, *FURTHER, *(cell for text in FURTHER for cell in text.split(";"))]
    texts += [each for text in texts for each in (text.upper(), text.title())]
    mine = [text for text in texts if encodable(text, encoding)]
    assert len(mine) > 10
    refused = [text for text in mine if not guessed(text.encode(encoding))[1]]
    assert refused == []


@pytest.mark.parametrize("encoding", ["cp1252", "cp1250", "cp1251"])
def test_a_heading_that_is_known_tells_the_encoding(encoding: str) -> None:
    other = {"cp1252": "cp1250", "cp1250": "cp1252", "cp1251": "cp1252"}[encoding]
    mine = [each for each in HEADINGS if encodable(each, encoding) and not encodable(each, other)]
    if encoding == "cp1252":
        mine += ["pièce", "peça", "mesuré", "medición", "numéro de série", "fenêtre", "posição", "velocità", "contrôle"]
    mine = [each for each in mine if not set(each) & set("őăű")]  # õ, ã and û are as good there, and so is the heading
    found = {each: each.encode(encoding).decode(guessed(f"{each};x".encode(encoding))[0]) for each in mine}
    assert {each: text for each, text in found.items() if text != each} == {}


@pytest.mark.parametrize(
    ("encoding", "text"),
    [
        *(
            ("cp1250", each)
            for each in (
                "Külső-ű",
                "Belső átmérő",
                "Wałek",
                "Średnica",
                "Szerokość",
                "Průměr",
                "Šířka",
                "faţă",
                "Točkić",
                "Hriadeľ",
                "Kužeľ",
                "Şaibă",
                "Lăcaş",
            )
        ),
        *(
            ("cp1252", each)
            for each in (
                "Modèle",
                "Længde",
                "Høyde",
                "Längd å",
                "Diâmetro furação",
                "Größe",
                "Ø40",
                "Año ñ",
                "Läbimõõt",
                "Hauteur pièce",
                "InnenØ",
                "MaßÄnderung",
                "Diámetro real",
                "Nº de peça",
            )
        ),
        *(("cp1251", each) for each in ("Вал", "Кольцо ось", "Объём", "Пречник жлеба", "Внутрішній", "УГОЛ", "Паз")),
        *(("cp1253", each) for each in ("Διάμετρος", "Ο άξονας", "οπή", "ΔΙΑΜΕΤΡΟΣ", "ΜΗΚΟΣ", "ΓΩΝΙΑ")),
        *(("cp1254", each) for each in ("İç çap", "Dış-Ş1", "Gövde ağız")),
        *(("cp1257", each) for each in ("Žiedas ė", "Ašis ė")),
        *(("cp850", each) for each in ("Gehäuse", "Größe", "Außenmaß", "Fuß", "Diamètre")),
        *(("cp852", each) for each in ("Točkić žleb", "Průměr", "Rozměr", "drážky")),
        *(("cp866", each) for each in ("Диаметр", "отверстие")),
        *(("iso-8859-2", each) for each in ("Dužina", "Kužeľ")),
    ],
)
def test_a_name_of_one_language_keeps_its_letters(encoding: str, text: str) -> None:
    """A wrong letter in a name is another name, and nobody sees it among thousands of rows."""
    content = f"Time;D40;Part\n18.11.2025 06:05;40,001;{text}\n".encode(encoding)
    name, european = guessed(content)
    assert european
    assert content.decode(name) == content.decode(encoding)


@pytest.mark.parametrize("encoding", ASIA)
def test_letters_of_east_asia_are_asked_about(tmp_path: Path, encoding: str) -> None:
    assert encoding in TO_NAME
    assert encoding in ENCODINGS
    path = tmp_path / "a.csv"
    for head in ASIA[encoding]:
        path.write_bytes(f"{head}\r\n1,2,3\r\n".encode(encoding))
        with pytest.raises(Unusable, match=f"--encoding.*{encoding}"):
            encoding_of(path)


def test_names_of_aqdef_are_asked_about_and_graphics_are_not(tmp_path: Path) -> None:
    path = tmp_path / "a.dfq"
    path.write_bytes("K0100 1\r\nK1001 ring\r\nK2002/1 外径測定\r\n".encode("cp932"))
    with pytest.raises(Unusable, match="cp932"):
        of_aqdef(path)
    path.write_bytes("K0100 1\r\nK1002 Welle Größe\r\nK5003/1 ".encode("cp1252") + bytes(range(128, 256)) + b"\r\n")
    assert of_aqdef(path) == "cp1252"
