"""The labelling page and its API."""

from __future__ import annotations

from fastapi import APIRouter

from server import labelling_api, labelling_pages

router = APIRouter()
router.include_router(labelling_api.router)
router.include_router(labelling_pages.router)
